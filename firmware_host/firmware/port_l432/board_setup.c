/* Wiring: USART2 to the ST-LINK (TX PA2, RX PA15), SPI1 on PB3 PB4 PB5; heater on PA6; the sensors' own
   pins are wiring.c's. */
#include "board_setup.h"

#include "pins.h"
#include "protocol.h"
#include "registers.h"
#include "wiring.h"

#define TICK_HZ 20u

/* MSI 4 MHz × 40 / 2. The MSI, not the HSI: it can be locked to the board's crystal. Flash needs 4 wait states above 64 MHz. */
static void setup_clock(void)
{
    FLASH_ACR = FLASH_ACR_LATENCY(4u) | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    while ((FLASH_ACR & FLASH_ACR_LATENCY(7u)) != FLASH_ACR_LATENCY(4u)) /* the wait states hold once they read back */
        ;
    RCC_PLLCFGR = RCC_PLLCFGR_PLLSRC(1u) | RCC_PLLCFGR_PLLM(0u) | RCC_PLLCFGR_PLLN(40u) | RCC_PLLCFGR_PLLR(0u) |
                  RCC_PLLCFGR_PLLREN;
    RCC_CR |= RCC_CR_PLLON;
    while (!(RCC_CR & RCC_CR_PLLRDY))
        ;
    RCC_CFGR = RCC_CFGR_SW(3u);
    while ((RCC_CFGR & RCC_CFGR_SWS(3u)) != RCC_CFGR_SWS(3u))
        ;
}

static void setup_power_to_peripherals(void)
{
    RCC_AHB1ENR |= RCC_AHB1ENR_DMA1EN;
    RCC_AHB2ENR |= RCC_AHB2ENR_GPIOAEN | RCC_AHB2ENR_GPIOBEN;
    RCC_APB1ENR1 |= RCC_APB1ENR1_TIM2EN | RCC_APB1ENR1_USART2EN | RCC_APB1ENR1_PWREN;
    RCC_APB2ENR |= RCC_APB2ENR_SYSCFGEN | RCC_APB2ENR_SPI1EN | RCC_APB2ENR_TIM16EN;
    (void)RCC_APB2ENR; /* the read lets the clocks start before the first access */
}

static void start_crystal(void)
{
    PWR_CR1 |= PWR_CR1_DBP;
    while (!(PWR_CR1 & PWR_CR1_DBP)) /* until then a write to BDCR is lost */
        ;
    if (!(RCC_BDCR & RCC_BDCR_LSEON))
        RCC_BDCR &= ~RCC_BDCR_LSEBYP; /* it survives resets, and would report a missing clock as ready */
    RCC_BDCR |= RCC_BDCR_LSEON;
}

bool setup_lock_clock(void)
{
    if (!(RCC_BDCR & RCC_BDCR_LSERDY))
        return false;
    RCC_CR |= RCC_CR_MSIPLLEN;
    return true;
}

/* Pulls give a disconnected wire a level: sensor bytes of 0xFF, a silent serial line. */
static void setup_pins(void)
{
    GPIOA_AFRL |= GPIOA_AFRL_AFRL2(7u);
    GPIOA_AFRH |= GPIOA_AFRH_AFRH15(3u);
    GPIOA_PUPDR = (GPIOA_PUPDR & ~PIN_MASK(15u)) | PER_PIN(15u, PULL_UP);
    GPIOA_OSPEEDR = (GPIOA_OSPEEDR & ~PIN_MASK(2u)) | PER_PIN(2u, SPEED_MEDIUM);
    GPIOA_MODER = (GPIOA_MODER & ~(PIN_MASK(2u) | PIN_MASK(15u))) | PER_PIN(2u, PIN_ALTERNATE) | PER_PIN(15u, PIN_ALTERNATE);

    GPIOB_AFRL |= GPIOB_AFRL_AFRL3(5u) | GPIOB_AFRL_AFRL4(5u) | GPIOB_AFRL_AFRL5(5u);
    GPIOB_PUPDR = (GPIOB_PUPDR & ~PIN_MASK(4u)) | PER_PIN(4u, PULL_UP);
    GPIOB_OSPEEDR = (GPIOB_OSPEEDR & ~(PIN_MASK(3u) | PIN_MASK(5u))) | PER_PIN(3u, SPEED_MEDIUM) | PER_PIN(5u, SPEED_MEDIUM);
    GPIOB_MODER = (GPIOB_MODER & ~(PIN_MASK(3u) | PIN_MASK(4u) | PIN_MASK(5u))) | PER_PIN(3u, PIN_ALTERNATE) |
                  PER_PIN(4u, PIN_ALTERNATE) | PER_PIN(5u, PIN_ALTERNATE);

    GPIOB_PUPDR = (GPIOB_PUPDR & ~PIN_MASK(LAMP_PIN)) | PER_PIN(LAMP_PIN, PULL_DOWN);
    GPIOB_BSRR = 1u << LAMP_PIN; /* it is an output only while the lamp is lit */
    wiring_setup();
}

static void setup_microseconds(void)
{
    TIM2_PSC = CLOCK_HZ / 1000000u - 1u;
    TIM2_ARR = 0xFFFFFFFFu; /* 0 after reset by the maker's register file, which would stop the counter */
    TIM2_EGR = TIM2_EGR_UG; /* loads the prescaler */
    TIM2_CR1 = TIM2_CR1_CEN;
}

#define HEATER_PERIODS 255u /* per cycle, equal to the highest power, at which the pin stays high */

/* After a reset the pin is an input, pulled down by the heater's own resistor; from here on the timer drives it, at power 0. */
static void setup_heater(void)
{
    TIM16_PSC = CLOCK_HZ / (1000u * HEATER_PERIODS) - 1u;
    TIM16_ARR = HEATER_PERIODS - 1u;
    TIM16_CCMR1_Output = TIM16_CCMR1_Output_OC1M(6u) | TIM16_CCMR1_Output_OC1PE;
    TIM16_EGR = TIM16_EGR_UG; /* loads the prescaler and the power, which is 0 */
    TIM16_CCER = TIM16_CCER_CC1E;
    TIM16_BDTR = TIM16_BDTR_MOE;
    TIM16_CR1 = TIM16_CR1_CEN;
    GPIOA_AFRL |= GPIOA_AFRL_AFRL6(14u);
    GPIOA_MODER = (GPIOA_MODER & ~PIN_MASK(6u)) | PER_PIN(6u, PIN_ALTERNATE);
}

/* Mode 3, supported by all sensors; eight bits, two at a time in the FIFO. The slowest clock until bus_xfer. */
static void setup_spi(void)
{
    SPI1_CR2 = SPI1_CR2_DS(7u);
    SPI1_CR1 = SPI1_CR1_CPHA | SPI1_CR1_CPOL | SPI1_CR1_MSTR | SPI1_CR1_BR(7u) | SPI1_CR1_SSM | SPI1_CR1_SSI;
    SPI1_CR1 |= SPI1_CR1_SPE;
}

/* Without OVRDIS one late byte would stop the receiver; the CRC detects the gap anyway. */
static void setup_serial(void)
{
    DMA1_CSELR |= DMA1_CSELR_C7S(2u);
    DMA1_CPAR7 = (uint32_t)&USART2_TDR;
    USART2_BRR = (CLOCK_HZ + BAUD_RATE / 2u) / BAUD_RATE;
    USART2_CR3 = USART2_CR3_DMAT | USART2_CR3_OVRDIS;
    USART2_CR1 = USART2_CR1_UE | USART2_CR1_RE | USART2_CR1_TE | USART2_CR1_RXNEIE;
}

#define LATER 0x10u /* the next priority after the data-ready edges', whose time stamps must not be delayed */

static void setup_interrupts(void)
{
    NVIC_IPR4 = NVIC_IPR4_IPR_N1(LATER); /* DMA1_CH7 */
    NVIC_IPR9 = NVIC_IPR9_IPR_N2(LATER); /* USART2 */
    NVIC_ISER0 = 1u << EXTI0_IRQ | 1u << EXTI1_IRQ | 1u << EXTI2_IRQ | 1u << EXTI3_IRQ | 1u << EXTI4_IRQ |
                 1u << EXTI9_5_IRQ | 1u << DMA1_CH7_IRQ; /* lines without a sensor are not enabled */
    NVIC_ISER1 = 1u << (USART2_IRQ - 32u) | 1u << (EXTI15_10_IRQ - 32u);
    STK_LOAD = CLOCK_HZ / TICK_HZ - 1u;
    STK_VAL = 0;
    STK_CTRL = STK_CTRL_ENABLE | STK_CTRL_TICKINT | STK_CTRL_CLKSOURCE;
}

/* About one second of the 32 kHz oscillator; the main loop's tick resets it 20 times in that time. */
static void setup_watchdog(void)
{
    IWDG_KR = 0xCCCCu; /* start */
    IWDG_KR = 0x5555u; /* unlock */
    IWDG_PR = 3u;      /* / 32 */
    IWDG_RLR = 1000u;
}

void setup_hardware(void)
{
    setup_clock();
    setup_power_to_peripherals();
    start_crystal();
    setup_pins();
    setup_microseconds();
    setup_heater();
    setup_spi();
    setup_serial();
    setup_interrupts();
    setup_watchdog();
}
