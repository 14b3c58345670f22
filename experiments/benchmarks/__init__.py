"""How fast the library is, beside C compiled from the same equations and beside other programs."""
