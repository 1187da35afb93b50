"""A case: everything that makes one run of a gear pair."""
