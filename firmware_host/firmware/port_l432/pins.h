/* A pin's settings: two bits of each of its port's registers. */
#ifndef PINS_H
#define PINS_H

#include <stdint.h>

enum pin_mode { PIN_INPUT = 0, PIN_OUTPUT = 1, PIN_ALTERNATE = 2 };
enum pin_pull { PULL_UP = 1, PULL_DOWN = 2 };
enum pin_speed { SPEED_MEDIUM = 1 }; /* enough for 5 MHz; faster edges would ring on loose wires */
#define LAMP_PIN 6u /* of port B, D5: lamp and button */
#define PER_PIN(pin, value) ((uint32_t)(value) << (2u * (pin)))
#define PIN_MASK(pin) PER_PIN(pin, 3u)

#endif
