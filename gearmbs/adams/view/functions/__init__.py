"""Functions of View's design-time expressions: names, numbers of arguments, and what they do.

Nothing here reads a file, starts a program or asks the system.
"""
