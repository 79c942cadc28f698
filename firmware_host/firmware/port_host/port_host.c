/* The core as a library on the host: the caller is the chip. */
#include "port.h"

#include <string.h>

#include "protocol.h"

typedef void (*bus_function)(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);
typedef void (*transmit_function)(const uint8_t *bytes, size_t size);
typedef void (*restart_function)(void);
typedef bool (*line_function)(unsigned sensor);

static bus_function on_bus;
static transmit_function on_transmit;
static restart_function on_restart;
static line_function on_line;
static uint32_t time_us;
static bool button_is_down, lamp_is_lit, clock_is_locked;
static uint8_t heating;
static const uint8_t unique_id[12] = {0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF, 0x01, 0x23, 0x45, 0x67};

void host_connect(bus_function bus, transmit_function transmit, restart_function restart);
void host_watch_lines(line_function line);
void host_set_time_us(uint32_t now_us);
void host_press(bool down);
bool host_lamp(void);
void host_lock_clock(bool locked);
uint8_t host_heating(void);

void host_connect(bus_function bus, transmit_function transmit, restart_function restart)
{
    on_bus = bus;
    on_transmit = transmit;
    on_restart = restart;
}

/* The caller's function for the data-ready lines' levels; without it they are low. */
void host_watch_lines(line_function line)
{
    on_line = line;
}

void host_set_time_us(uint32_t now_us)
{
    time_us = now_us;
}

void host_press(bool down)
{
    button_is_down = down;
}

bool host_lamp(void)
{
    return lamp_is_lit;
}

void host_lock_clock(bool locked)
{
    clock_is_locked = locked;
}

void port_set_lamp(bool lit)
{
    lamp_is_lit = lit;
}

/* The lamp's wire is high too. */
bool port_button_is_down(void)
{
    return button_is_down || lamp_is_lit;
}

uint32_t port_time_us(void)
{
    return time_us;
}

void port_wait_us(uint32_t duration_us)
{
    time_us += duration_us;
}

void port_heat(uint8_t power)
{
    heating = power;
}

/* The duty of the heater's pin, of 255. */
uint8_t host_heating(void)
{
    return heating;
}

void port_listen(uint8_t mask)
{
    (void)mask; /* the caller controls the lines itself */
}

bool port_line_is_high(unsigned sensor)
{
    return on_line != NULL && on_line(sensor);
}

void bus_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size)
{
    on_bus(device, max_hz, bytes, size);
}

void port_transmit(const uint8_t *bytes, size_t size)
{
    on_transmit(bytes, size);
}

void port_restart(void)
{
    on_restart();
}

void port_health(struct port_health *health)
{
    memset(health, 0, sizeof *health);
    health->reset_cause = RESET_POWER;
    health->clock_locked = clock_is_locked;
}

const uint8_t *port_unique_id(void)
{
    return unique_id;
}
