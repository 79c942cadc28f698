"""What was calibrated and recorded, in the files of other programs.

Here g = K (m + b); every other program adds its bias or subtracts its offset the other way round, so theirs is −b.
"""
