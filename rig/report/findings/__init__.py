"""What any kind of result can say to every outlet, and the characteristics that it states."""
