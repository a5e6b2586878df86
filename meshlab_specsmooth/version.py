"""The version, in one place: the package, its wheel and its command line read it here."""

VERSION = "0.1.0"
