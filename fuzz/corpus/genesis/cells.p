*start_cell /library/spine
neck none 0 1 0 .1
head . 0 .5 0 .5
*makeproto /library/spine
*start_cell
soma none 0 0 0 9
d soma 0 9 9 1
*start_cell /two
soma none 0 0 0 5
*whatever 1
