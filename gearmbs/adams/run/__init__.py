"""A script carried out on a deck: its analyses and the changes between them."""
