soma . 0 0
