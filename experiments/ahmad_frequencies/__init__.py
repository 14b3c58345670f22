"""Ahmad et al. (2008): what the natural frequencies depend on, against a finite-element limit."""
