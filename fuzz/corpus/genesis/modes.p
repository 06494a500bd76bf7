*polar
*relative
*spherical
soma none 0 0 0 20
*cylindrical
axon soma 10 90 0 1
*absolute
*cartesian
*double_endpoint
dend soma 0 10 0 0 30 0 2
dend2 dend 0 31 0 0 40 0 -1
*double_endpoint_off
tuft nobody 1 2 3 nan
