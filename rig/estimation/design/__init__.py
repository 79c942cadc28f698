"""How much a design tells before anything is measured: bounds and optimality."""
