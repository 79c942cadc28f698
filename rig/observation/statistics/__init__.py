"""Means and the variance of means: coloured noise, vibrations as spectral lines, tapered windows."""
