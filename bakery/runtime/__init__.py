"""What a player does with a bundle, in clear numpy: the reference that every other player must match."""
