/* never ends
soma none 0 0 0 1
