"""The motion of the turner (arm, rate table or servo) as a function of time: joints, revolutions, speeds."""
