"""How the simulated arm moves: trajectories, joints and their errors, links, flange."""
