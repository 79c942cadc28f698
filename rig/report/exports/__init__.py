"""Calibrations and recordings in the file formats of other programs.

The rig's model is g = K (m + b); all other programs define the bias with the opposite sign, −b.
"""
