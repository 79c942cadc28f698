/* The board's behaviour: answers the host, streams samples. */
#ifndef BOARD_H
#define BOARD_H

void board_reset(void);

/* One pass of the main loop; call it after every interrupt and at least every 50 ms. */
void board_run(void);

#endif
