/* The board without a computer: a button begins a calibration by hand, and a lamp shows its status. */
#ifndef ALONE_H
#define ALONE_H

void alone_reset(void);
void alone_run(void);

#endif
