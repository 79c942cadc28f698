/* What the NMI asks of the flash. */
#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>

/* True when the NMI tells of an uncorrectable error where port_flash_read() reads, which then reports it. */
bool flash_take_torn_read(void);

#endif
