"""Text to typed statements: decks (.adm) and command scripts (.acf), read and checked."""
