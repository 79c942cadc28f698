/* The flash's part of the NMI handler. */
#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>

/* Returns true if the NMI signals an uncorrectable error in port_flash_read(), which then reports it. */
bool flash_take_torn_read(void);

#endif
