"""Ahmad et al. (2008), Fig. 4-5 and Table III: spectra of the end-point acceleration."""
