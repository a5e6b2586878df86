"""The version, read by the package, its wheel and its command line."""

VERSION = "0.1.0"
