/* The last sixteen pages of the flash. RM0394, section 3.3: keys, page erase (3.3.5), standard programming (3.3.7), ECC
   (3.3.2).

   While the flash is busy, every fetch from it waits: the processor stops, 25 ms for a page, and interrupts too. The watchdog
   allows a second. No function here may run while sensors stream. */
#include "flash.h"

#include "port.h"
#include "registers.h"

#define FLASH_START 0x08000000u
#define ERRORS \
    (FLASH_SR_OPERR | FLASH_SR_PROGERR | FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_SIZERR | FLASH_SR_PGSERR)

extern volatile uint8_t store_start[FLASH_PAGES][FLASH_PAGE_BYTES]; /* the linker script's */

/* Images up to firmware 0.5 had the last six pages alone: their records remain valid. */
#define FIRST_PAGE (FLASH_PAGES - 6u)

static volatile bool reading, torn;

/* The data cache does not follow erasing and programming, and may contain a doubleword whose error was already reported. */
static void switch_cache_off(void)
{
    FLASH_ACR &= ~FLASH_ACR_DCEN;
}

static void switch_cache_on(void)
{
    FLASH_ACR |= FLASH_ACR_DCRST; /* only while it is off */
    FLASH_ACR &= ~FLASH_ACR_DCRST;
    FLASH_ACR |= FLASH_ACR_DCEN;
}

static volatile uint8_t *get_page(unsigned page)
{
    return store_start[(FIRST_PAGE + page) % FLASH_PAGES];
}

/* An earlier error, such as of a stray write, would block the next operation. */
static void begin(void)
{
    switch_cache_off();
    FLASH_KEYR = 0x45670123u;
    FLASH_KEYR = 0xCDEF89ABu;
    FLASH_SR = ERRORS;
}

static bool finish(void)
{
    __asm volatile("dsb" ::: "memory"); /* the start has arrived before the busy flag is read */
    while (FLASH_SR & FLASH_SR_BSY)
        ;
    bool done = (FLASH_SR & ERRORS) == 0;
    FLASH_CR = FLASH_CR_LOCK;
    switch_cache_on();
    return done;
}

bool port_flash_erase(unsigned page)
{
    begin();
    FLASH_CR = FLASH_CR_PER | FLASH_CR_PNB(((uint32_t)get_page(page) - FLASH_START) / FLASH_PAGE_BYTES);
    FLASH_CR |= FLASH_CR_START;
    return finish();
}

/* Two words in this order start it. The barrier keeps them apart in the write buffer, as ST's own library does. */
bool port_flash_program(unsigned page, size_t offset, uint64_t doubleword)
{
    volatile uint32_t *words = (volatile uint32_t *)(get_page(page) + offset);
    begin();
    FLASH_CR = FLASH_CR_PG;
    words[0] = (uint32_t)doubleword;
    __asm volatile("isb" ::: "memory");
    words[1] = (uint32_t)(doubleword >> 32);
    return finish();
}

bool port_flash_read(unsigned page, size_t offset, void *bytes, size_t size)
{
    uint8_t *to = bytes;
    volatile uint8_t *from = get_page(page) + offset;
    switch_cache_off();
    torn = false;
    reading = true;
    for (size_t i = 0; i < size && !torn; i++)
        to[i] = from[i];
    __asm volatile("dsb\n isb" ::: "memory"); /* an error of the last byte has occurred by now */
    reading = false;
    switch_cache_on();
    return !torn;
}

/* The flag is not evaluated: a power loss in the middle of an erase or a programming may spoil the register that holds it (ST's
   errata of the L4), and a record that cannot be read must not keep the board from starting. */
bool flash_take_torn_read(void)
{
    if (!reading)
        return false;
    FLASH_ECCR = FLASH_ECCR_ECCD | FLASH_ECCR_ECCC; /* written 1 to clear; a flag still set on return would raise the NMI again
                                                       */
    __asm volatile("dsb" ::: "memory");
    torn = true;
    return true;
}
