"""What is done with results that are stored: held against their digests, packed into fewer files."""
