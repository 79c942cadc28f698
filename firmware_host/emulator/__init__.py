"""An emulated Cortex-M4 that runs the real firmware image, with register-level sensors on its SPI bus."""
