"""What is noise, and what is shape."""
