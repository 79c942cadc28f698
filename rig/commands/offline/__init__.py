"""Commands that compute and connect to nothing: solve, allan, reversal, study."""
