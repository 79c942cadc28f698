"""What only recordings of others need: attitudes that a reference states, and bodies that are laid down again."""
