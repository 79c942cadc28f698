"""The simulated Dynamixel X servo: registers, protocol 2.0, a profile generator and a shaft, on a serial line."""
