"""What turned, as a function of time: joints, revolutions, speeds."""
