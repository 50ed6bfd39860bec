"""What moves an avatar: takes, made from clips and fitted to other faces."""
