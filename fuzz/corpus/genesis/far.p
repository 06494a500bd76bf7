soma none 1e39 0 0 1
