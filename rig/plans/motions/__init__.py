"""The motions that procedures plan: sweeps, attitudes, temperatures, and the transfers between them."""
