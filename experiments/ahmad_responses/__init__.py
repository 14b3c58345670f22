"""Ahmad et al. (2008), Fig. 2-3 and Table II: the bang-bang response."""
