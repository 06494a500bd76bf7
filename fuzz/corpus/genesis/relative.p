// a cell
*cartesian
*relative
*set_compt_param RM 0.3
soma none 30 0 0 30 Na 1200 K 360
dend soma 100 0 0 2 Ex 0.8
dend2 dend 50 10 0 1
dend3 . 5 5 5 1 // end
