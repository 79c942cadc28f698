"""The motion of the simulated arm: trajectories, joints and their errors, links, flange."""
