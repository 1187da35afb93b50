"""What compiled code is made with: views into flat tables, and calls through typed function pointers."""
