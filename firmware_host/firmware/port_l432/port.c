/* The chip behind core/port.h, its interrupts, and the main loop. */
#include "port.h"

#include <stdbool.h>

#include "acquisition.h"
#include "board.h"
#include "board_setup.h"
#include "link.h"
#include "pins.h"
#include "registers.h"
#include "sensors.h"
#include "startup.h"
#include "wiring.h"

#define SPI1_FIFO (*(volatile uint16_t *)&SPI1_DR) /* a 16-bit access moves two bytes */

static volatile bool woken;
static volatile bool ticked;
static bool clock_locked;
static uint32_t fault_pc;
static uint8_t reset_cause;

uint32_t port_time_us(void)
{
    return TIM2_CNT;
}

/* The counter may tick just after the first read, so wait for one more tick. */
void port_wait_us(uint32_t duration_us)
{
    uint32_t start_us = TIM2_CNT;
    while (TIM2_CNT - start_us <= duration_us)
        ;
}

/* PWM at 1 kHz, by the hardware: after a hang of the program it continues until the watchdog resets the chip, within a second.
   */
void port_heat(uint8_t power)
{
    TIM16_CCR1 = power;
}

/* An edge also pends a masked line. */
void port_listen(uint8_t mask)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        EXTI_IMR1 &= ~ready_lines[i].bit;
        EXTI_PR1 = ready_lines[i].bit;
        if (is_named(mask, i))
            EXTI_IMR1 |= ready_lines[i].bit;
    }
}

bool port_line_is_high(unsigned sensor)
{
    return (*ready_lines[sensor].level & ready_lines[sensor].bit) != 0;
}

/* The wire is high for a lit lamp, or while the button connects it to the supply; nothing drives it low. */
void port_set_lamp(bool lit)
{
    uint32_t mode = PER_PIN(LAMP_PIN, lit ? PIN_OUTPUT : PIN_INPUT);
    if ((GPIOB_MODER & PIN_MASK(LAMP_PIN)) != mode)
        GPIOB_MODER = (GPIOB_MODER & ~PIN_MASK(LAMP_PIN)) | mode;
}

bool port_button_is_down(void)
{
    return (GPIOB_IDR & 1u << LAMP_PIN) != 0;
}

static void set_bus_clock(uint32_t max_hz)
{
    uint32_t code = 0; /* CLOCK_HZ / 2, 4, … 256 */
    while (code < 7u && CLOCK_HZ >> (code + 1u) > max_hz)
        code++;
    SPI1_CR1 = (SPI1_CR1 & ~SPI1_CR1_BR(7u)) | SPI1_CR1_BR(code);
}

/* The ADIS16465 wants 200 ns between its select and the first clock (its data sheet, table 2): 16 cycles. */
static void wait_for_selected(void)
{
    __asm volatile(".rept 16\n nop\n .endr");
}

/* The second half of the last bit is still on the bus when it has been received: no deselect or clock change before its end. */
void bus_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size)
{
    set_bus_clock(max_hz);
    *selects[device].set_reset = selects[device].select;
    wait_for_selected();
    for (size_t i = 0; i < size; i += 2) {
        SPI1_FIFO = (uint16_t)(bytes[i] | bytes[i + 1] << 8);
        while (!(SPI1_SR & SPI1_SR_RXNE))
            ;
        uint16_t received = SPI1_FIFO;
        bytes[i] = (uint8_t)received;
        bytes[i + 1] = (uint8_t)(received >> 8);
    }
    while (SPI1_SR & SPI1_SR_BSY)
        ;
    *selects[device].set_reset = selects[device].deselect;
}

void port_transmit(const uint8_t *bytes, size_t size)
{
    DMA1_CCR7 = 0; /* address and count can be set only while the channel is off */
    DMA1_CMAR7 = (uint32_t)bytes;
    DMA1_CNDTR7 = size;
    __asm volatile("dmb" ::: "memory"); /* the bytes are in memory before the channel reads them */
    DMA1_CCR7 = DMA1_CCR7_EN | DMA1_CCR7_TCIE | DMA1_CCR7_TEIE | DMA1_CCR7_DIR | DMA1_CCR7_MINC;
}

void port_restart(void)
{
    while (!(USART2_ISR & USART2_ISR_TC))
        ;
    reset_chip();
}

void port_health(struct port_health *health)
{
    health->reset_cause = reset_cause;
    health->clock_locked = clock_locked;
    health->fault_pc = fault_pc;
    health->stack_high_water = stack_high_water();
}

const uint8_t *port_unique_id(void)
{
    return UNIQUE_ID;
}

/* Every reset also pulls the reset pin, so that flag counts last. */
static uint8_t cause_of_reset(uint32_t flags)
{
    if (fault_record.magic == FAULT_MAGIC)
        return RESET_FAULT;
    if (flags & RCC_CSR_IWDGRSTF)
        return RESET_WATCHDOG;
    if (flags & RCC_CSR_SFTRSTF)
        return RESET_SOFTWARE;
    if (flags & RCC_CSR_BORRSTF)
        return RESET_POWER;
    return flags & RCC_CSR_PINRSTF ? RESET_PIN : RESET_UNKNOWN;
}

static void remember_reset(void)
{
    reset_cause = cause_of_reset(RCC_CSR);
    fault_pc = reset_cause == RESET_FAULT ? fault_record.pc : 0;
    fault_record.magic = 0;
    RCC_CSR |= RCC_CSR_RMVF;
}

/* The barrier: a flag still set on return would repeat the same edge, which would count as a second conversion. Lines that
   share a handler are distinguished by their flags; the compiler removes those of other handlers. */
static inline void data_ready(uint32_t lines)
{
    uint32_t captured_us = TIM2_CNT; /* before anything else */
    uint32_t edges = EXTI_PR1 & EXTI_IMR1 & lines;
    EXTI_PR1 = edges;
#define TELL(driver, select_port, select_pin, ready_port, ready_pin) \
    if (lines & edges & 1u << (ready_pin)) \
        acquisition_data_ready(SENSOR_##driver, captured_us);
    SENSORS(TELL)
    woken = true;
    __asm volatile("dsb" ::: "memory");
}

void exti0_handler(void)
{
    data_ready(1u << 0);
}

void exti1_handler(void)
{
    data_ready(1u << 1);
}

void exti2_handler(void)
{
    data_ready(1u << 2);
}

void exti3_handler(void)
{
    data_ready(1u << 3);
}

void exti4_handler(void)
{
    data_ready(1u << 4);
}

void exti9_5_handler(void)
{
    data_ready(0x03E0u);
}

void exti15_10_handler(void)
{
    data_ready(0xFC00u);
}

void dma1_channel7_handler(void)
{
    DMA1_IFCR = DMA1_IFCR_CTCIF7 | DMA1_IFCR_CTEIF7; /* not CGIF7, which an erratum says may clear more than it names */
    link_sent();                                     /* also what was cut off: the CRC finds it, and the line goes on */
    woken = true;
}

void usart2_handler(void)
{
    link_byte_received((uint8_t)USART2_RDR);
    woken = true;
}

void systick_handler(void)
{
    ticked = true;
    woken = true;
}

static void tick(void)
{
    ticked = false;
    IWDG_KR = 0xAAAAu;
    if (!clock_locked)
        clock_locked = setup_lock_clock();
}

/* Interrupts are masked between looking and sleeping, or one in between would be slept through; a masked one still wakes. */
static void sleep_until_woken(void)
{
    __asm volatile("cpsid i" ::: "memory");
    if (!woken)
        __asm volatile("wfi\n isb" ::: "memory"); /* the barrier: an erratum of the flash at waking, while a debugger is on */
    __asm volatile("cpsie i\n isb" ::: "memory");
}

int main(void)
{
    remember_reset();
    setup_hardware();
    board_reset();
    for (;;) {
        woken = false;
        if (ticked)
            tick();
        board_run();
        sleep_until_woken();
    }
}
