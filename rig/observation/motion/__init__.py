"""The turner's motion as a function of time: joints, revolutions, speeds."""
