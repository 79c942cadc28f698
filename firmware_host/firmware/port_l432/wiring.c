#include "wiring.h"

#include "pins.h"
#include "registers.h"

enum port { PORT_A, PORT_B }; /* as SYSCFG counts them */

#define SELECT(driver, select_port, select_pin, ready_port, ready_pin) \
    {&GPIO##select_port##_BSRR, 1u << ((select_pin) + 16u), 1u << (select_pin)},
const struct select selects[SENSOR_COUNT] = {SENSORS(SELECT)};

#define LINE(driver, select_port, select_pin, ready_port, ready_pin) {&GPIO##ready_port##_IDR, 1u << (ready_pin)},
const struct ready_line ready_lines[SENSOR_COUNT] = {SENSORS(LINE)};

/* Two lines with one number would be one: a sum of bits is not the same as them all. */
#define PLUS(driver, select_port, select_pin, ready_port, ready_pin) +(1u << (ready_pin))
_Static_assert((0u SENSORS(PLUS)) == READY_LINES, "every data-ready pin has a number of its own");

struct wire {
    enum port port;
    unsigned pin;
};

static const struct {
    struct wire select, ready;
} wires[SENSOR_COUNT] = {
#define WIRES(driver, select_port, select_pin, ready_port, ready_pin) \
    {{PORT_##select_port, select_pin}, {PORT_##ready_port, ready_pin}},
    SENSORS(WIRES)};

static const struct {
    volatile uint32_t *mode, *pulls, *speed, *set_reset;
} ports[] = {
    [PORT_A] = {&GPIOA_MODER, &GPIOA_PUPDR, &GPIOA_OSPEEDR, &GPIOA_BSRR},
    [PORT_B] = {&GPIOB_MODER, &GPIOB_PUPDR, &GPIOB_OSPEEDR, &GPIOB_BSRR},
};

static volatile uint32_t *const line_ports[] = {&SYSCFG_EXTICR1, &SYSCFG_EXTICR2, &SYSCFG_EXTICR3, &SYSCFG_EXTICR4};

static void set(volatile uint32_t *setting, unsigned pin, uint32_t value)
{
    *setting = (*setting & ~PIN_MASK(pin)) | PER_PIN(pin, value);
}

/* A pull gives a disconnected wire a level, and a line without a part makes no edges. */
void wiring_setup(void)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        const struct wire *select = &wires[i].select, *ready = &wires[i].ready;
        *selects[i].set_reset = selects[i].deselect; /* before it is an output */
        set(ports[select->port].speed, select->pin, SPEED_MEDIUM);
        set(ports[select->port].mode, select->pin, PIN_OUTPUT);
        set(ports[ready->port].pulls, ready->pin, PULL_DOWN);
        set(ports[ready->port].mode, ready->pin, PIN_INPUT);
        *line_ports[ready->pin / 4u] |= (uint32_t)ready->port << 4u * (ready->pin % 4u);
    }
    EXTI_RTSR1 |= READY_LINES;
}
