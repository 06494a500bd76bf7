// Brain Forest GENESIS cell 1
//@note a%20b c%0ad%zz%
*cartesian
*absolute
*double_endpoint
//@ends 4 2 0
soma none 0 0 0 0 5 0 3
//@ends 2 3 0
soma_2 soma 0 0 0 9 0 0 7
//@ends 1 1 7
custom9_0_1 soma 0 5 0 0 9 0 2
custom9_1_1 custom9_0_1 0 9 0 0 19 0 2
customm5_2_1 none 1 1 1 2 2 2 1
