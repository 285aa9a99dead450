"""What may the files hold that graspproof reads and writes? The command `schema` tells it."""
