"""What a plan says: what varies, by which design, which points are left out."""
