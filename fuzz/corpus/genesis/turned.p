/* two
lines */ *relative
basal_1 none 0 10 0 2
soma basal_1 0 12 0 8
apical_1 soma 0 50 0 3
soma2 apical_1 1 1 1 1
x none 0 0 0 1
x x 1 0 0 1
