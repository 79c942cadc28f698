/* Flash in RAM. The caller may observe each operation and cut the power during it. */
#include <string.h>

#include "port.h"

#define DOUBLEWORD 8u

/* Called before an erase (`doubleword` NULL) or the programming of a doubleword. False: the power fails during it. The caller
   then writes the torn content into the memory, and answers false until power is back. */
typedef bool (*flash_function)(unsigned page, size_t offset, const uint64_t *doubleword);

static struct {
    uint8_t bytes[FLASH_PAGES][FLASH_PAGE_BYTES];
    bool torn[FLASH_PAGES][FLASH_PAGE_BYTES / DOUBLEWORD];       /* reading it fails */
    bool programmed[FLASH_PAGES][FLASH_PAGE_BYTES / DOUBLEWORD]; /* since the last erase */
} flash = {.bytes = {[0 ... FLASH_PAGES - 1] = {[0 ... FLASH_PAGE_BYTES - 1] = 0xFF}}};

static flash_function on_flash;

uint8_t *host_flash_bytes(unsigned page);
void host_flash_tear(unsigned page, size_t offset);
void host_flash_watch(flash_function watch);
void host_flash_clear(void);

uint8_t *host_flash_bytes(unsigned page)
{
    return flash.bytes[page];
}

void host_flash_tear(unsigned page, size_t offset)
{
    flash.torn[page][offset / DOUBLEWORD] = true;
}

void host_flash_watch(flash_function watch)
{
    on_flash = watch;
}

static void clear(unsigned page)
{
    memset(flash.bytes[page], 0xFF, sizeof flash.bytes[page]);
    memset(flash.torn[page], 0, sizeof flash.torn[page]);
    memset(flash.programmed[page], 0, sizeof flash.programmed[page]);
}

void host_flash_clear(void)
{
    for (unsigned page = 0; page < FLASH_PAGES; page++)
        clear(page);
    on_flash = NULL;
}

bool port_flash_read(unsigned page, size_t offset, void *bytes, size_t size)
{
    for (size_t i = offset / DOUBLEWORD; i * DOUBLEWORD < offset + size; i++)
        if (flash.torn[page][i])
            return false;
    memcpy(bytes, &flash.bytes[page][offset], size);
    return true;
}

bool port_flash_erase(unsigned page)
{
    if (on_flash != NULL && !on_flash(page, 0, NULL))
        return false;
    clear(page);
    return true;
}

bool port_flash_program(unsigned page, size_t offset, uint64_t doubleword)
{
    if (on_flash != NULL && !on_flash(page, offset, &doubleword))
        return false;
    if (flash.programmed[page][offset / DOUBLEWORD])
        return false;
    flash.programmed[page][offset / DOUBLEWORD] = true;
    memcpy(&flash.bytes[page][offset], &doubleword, sizeof doubleword);
    return true;
}
