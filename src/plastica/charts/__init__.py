"""Charts of many equilibria and many motions."""
