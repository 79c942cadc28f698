"""The simulated hand: a person's motions while turning a box on a table and laying it down, including mistakes."""
