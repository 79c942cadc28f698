/* The registers of the STM32L432 and its core that the port uses, and no others. Names, addresses, offsets, bits and interrupt
   numbers are the SVD's; tests/firmware_host/firmware/test_firmware_image.py compares every line. Reference manual RM0394. */
#ifndef REGISTERS_H
#define REGISTERS_H

#include <stdint.h>

#define REGISTER(base, offset) (*(volatile uint32_t *)((base) + (offset)))

#define RCC_BASE 0x40021000u
#define RCC_CR REGISTER(RCC_BASE, 0x00u)
#define RCC_CR_MSIPLLEN (1u << 2)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_CFGR REGISTER(RCC_BASE, 0x08u)
#define RCC_CFGR_SW(value) ((value) << 0)
#define RCC_CFGR_SWS(value) ((value) << 2)
#define RCC_PLLCFGR REGISTER(RCC_BASE, 0x0Cu)
#define RCC_PLLCFGR_PLLSRC(value) ((value) << 0)
#define RCC_PLLCFGR_PLLM(value) ((value) << 4)
#define RCC_PLLCFGR_PLLN(value) ((value) << 8)
#define RCC_PLLCFGR_PLLREN (1u << 24)
#define RCC_PLLCFGR_PLLR(value) ((value) << 25)
#define RCC_AHB1ENR REGISTER(RCC_BASE, 0x48u)
#define RCC_AHB1ENR_DMA1EN (1u << 0)
#define RCC_AHB2ENR REGISTER(RCC_BASE, 0x4Cu)
#define RCC_AHB2ENR_GPIOAEN (1u << 0)
#define RCC_AHB2ENR_GPIOBEN (1u << 1)
#define RCC_APB1ENR1 REGISTER(RCC_BASE, 0x58u)
#define RCC_APB1ENR1_TIM2EN (1u << 0)
#define RCC_APB1ENR1_USART2EN (1u << 17)
#define RCC_APB1ENR1_PWREN (1u << 28)
#define RCC_APB2ENR REGISTER(RCC_BASE, 0x60u)
#define RCC_APB2ENR_SYSCFGEN (1u << 0)
#define RCC_APB2ENR_SPI1EN (1u << 12)
#define RCC_APB2ENR_TIM16EN (1u << 17)
#define RCC_BDCR REGISTER(RCC_BASE, 0x90u)
#define RCC_BDCR_LSEON (1u << 0)
#define RCC_BDCR_LSERDY (1u << 1)
#define RCC_BDCR_LSEBYP (1u << 2)
#define RCC_CSR REGISTER(RCC_BASE, 0x94u)
#define RCC_CSR_RMVF (1u << 23)
#define RCC_CSR_PINRSTF (1u << 26)
#define RCC_CSR_BORRSTF (1u << 27)
#define RCC_CSR_SFTRSTF (1u << 28)
#define RCC_CSR_IWDGRSTF (1u << 29)

#define FLASH_BASE 0x40022000u
#define FLASH_ACR REGISTER(FLASH_BASE, 0x00u)
#define FLASH_ACR_LATENCY(value) ((value) << 0)
#define FLASH_ACR_PRFTEN (1u << 8)
#define FLASH_ACR_ICEN (1u << 9)
#define FLASH_ACR_DCEN (1u << 10)
#define FLASH_ACR_DCRST (1u << 12)
#define FLASH_KEYR REGISTER(FLASH_BASE, 0x08u)
#define FLASH_SR REGISTER(FLASH_BASE, 0x10u)
#define FLASH_SR_OPERR (1u << 1)
#define FLASH_SR_PROGERR (1u << 3)
#define FLASH_SR_WRPERR (1u << 4)
#define FLASH_SR_PGAERR (1u << 5)
#define FLASH_SR_SIZERR (1u << 6)
#define FLASH_SR_PGSERR (1u << 7)
#define FLASH_SR_BSY (1u << 16)
#define FLASH_CR REGISTER(FLASH_BASE, 0x14u)
#define FLASH_CR_PG (1u << 0)
#define FLASH_CR_PER (1u << 1)
#define FLASH_CR_PNB(value) ((value) << 3)
#define FLASH_CR_START (1u << 16)
#define FLASH_CR_LOCK (1u << 31)
#define FLASH_ECCR REGISTER(FLASH_BASE, 0x18u)
#define FLASH_ECCR_ECCC (1u << 30)
#define FLASH_ECCR_ECCD (1u << 31)

#define PWR_BASE 0x40007000u
#define PWR_CR1 REGISTER(PWR_BASE, 0x00u)
#define PWR_CR1_DBP (1u << 8)

#define GPIOA_BASE 0x48000000u
#define GPIOA_MODER REGISTER(GPIOA_BASE, 0x00u)
#define GPIOA_OSPEEDR REGISTER(GPIOA_BASE, 0x08u)
#define GPIOA_PUPDR REGISTER(GPIOA_BASE, 0x0Cu)
#define GPIOA_IDR REGISTER(GPIOA_BASE, 0x10u)
#define GPIOA_BSRR REGISTER(GPIOA_BASE, 0x18u)
#define GPIOA_AFRL REGISTER(GPIOA_BASE, 0x20u)
#define GPIOA_AFRL_AFRL2(value) ((value) << 8)
#define GPIOA_AFRL_AFRL6(value) ((value) << 24)
#define GPIOA_AFRH REGISTER(GPIOA_BASE, 0x24u)
#define GPIOA_AFRH_AFRH15(value) ((value) << 28)

#define GPIOB_BASE 0x48000400u
#define GPIOB_MODER REGISTER(GPIOB_BASE, 0x00u)
#define GPIOB_OSPEEDR REGISTER(GPIOB_BASE, 0x08u)
#define GPIOB_PUPDR REGISTER(GPIOB_BASE, 0x0Cu)
#define GPIOB_IDR REGISTER(GPIOB_BASE, 0x10u)
#define GPIOB_BSRR REGISTER(GPIOB_BASE, 0x18u)
#define GPIOB_AFRL REGISTER(GPIOB_BASE, 0x20u)
#define GPIOB_AFRL_AFRL3(value) ((value) << 12)
#define GPIOB_AFRL_AFRL4(value) ((value) << 16)
#define GPIOB_AFRL_AFRL5(value) ((value) << 20)

#define SYSCFG_BASE 0x40010000u
#define SYSCFG_EXTICR1 REGISTER(SYSCFG_BASE, 0x08u)
#define SYSCFG_EXTICR2 REGISTER(SYSCFG_BASE, 0x0Cu)
#define SYSCFG_EXTICR3 REGISTER(SYSCFG_BASE, 0x10u)
#define SYSCFG_EXTICR4 REGISTER(SYSCFG_BASE, 0x14u)

#define EXTI_BASE 0x40010400u
#define EXTI_IMR1 REGISTER(EXTI_BASE, 0x00u)
#define EXTI_RTSR1 REGISTER(EXTI_BASE, 0x08u)
#define EXTI_PR1 REGISTER(EXTI_BASE, 0x14u)

#define DMA1_BASE 0x40020000u
#define DMA1_IFCR REGISTER(DMA1_BASE, 0x04u)
#define DMA1_IFCR_CTCIF7 (1u << 25)
#define DMA1_IFCR_CTEIF7 (1u << 27)
#define DMA1_CCR7 REGISTER(DMA1_BASE, 0x80u)
#define DMA1_CCR7_EN (1u << 0)
#define DMA1_CCR7_TCIE (1u << 1)
#define DMA1_CCR7_TEIE (1u << 3)
#define DMA1_CCR7_DIR (1u << 4)
#define DMA1_CCR7_MINC (1u << 7)
#define DMA1_CNDTR7 REGISTER(DMA1_BASE, 0x84u)
#define DMA1_CPAR7 REGISTER(DMA1_BASE, 0x88u)
#define DMA1_CMAR7 REGISTER(DMA1_BASE, 0x8Cu)
#define DMA1_CSELR REGISTER(DMA1_BASE, 0xA8u)
#define DMA1_CSELR_C7S(value) ((value) << 24)

#define USART2_BASE 0x40004400u
#define USART2_CR1 REGISTER(USART2_BASE, 0x00u)
#define USART2_CR1_UE (1u << 0)
#define USART2_CR1_RE (1u << 2)
#define USART2_CR1_TE (1u << 3)
#define USART2_CR1_RXNEIE (1u << 5)
#define USART2_CR3 REGISTER(USART2_BASE, 0x08u)
#define USART2_CR3_DMAT (1u << 7)
#define USART2_CR3_OVRDIS (1u << 12)
#define USART2_BRR REGISTER(USART2_BASE, 0x0Cu)
#define USART2_ISR REGISTER(USART2_BASE, 0x1Cu)
#define USART2_ISR_TC (1u << 6)
#define USART2_RDR REGISTER(USART2_BASE, 0x24u)
#define USART2_TDR REGISTER(USART2_BASE, 0x28u)

#define SPI1_BASE 0x40013000u
#define SPI1_CR1 REGISTER(SPI1_BASE, 0x00u)
#define SPI1_CR1_CPHA (1u << 0)
#define SPI1_CR1_CPOL (1u << 1)
#define SPI1_CR1_MSTR (1u << 2)
#define SPI1_CR1_BR(value) ((value) << 3)
#define SPI1_CR1_SPE (1u << 6)
#define SPI1_CR1_SSI (1u << 8)
#define SPI1_CR1_SSM (1u << 9)
#define SPI1_CR2 REGISTER(SPI1_BASE, 0x04u)
#define SPI1_CR2_DS(value) ((value) << 8)
#define SPI1_SR REGISTER(SPI1_BASE, 0x08u)
#define SPI1_SR_RXNE (1u << 0)
#define SPI1_SR_BSY (1u << 7)
#define SPI1_DR REGISTER(SPI1_BASE, 0x0Cu)

#define TIM2_BASE 0x40000000u
#define TIM2_CR1 REGISTER(TIM2_BASE, 0x00u)
#define TIM2_CR1_CEN (1u << 0)
#define TIM2_EGR REGISTER(TIM2_BASE, 0x14u)
#define TIM2_EGR_UG (1u << 0)
#define TIM2_CNT REGISTER(TIM2_BASE, 0x24u)
#define TIM2_PSC REGISTER(TIM2_BASE, 0x28u)
#define TIM2_ARR REGISTER(TIM2_BASE, 0x2Cu)

#define TIM16_BASE 0x40014400u
#define TIM16_CR1 REGISTER(TIM16_BASE, 0x00u)
#define TIM16_CR1_CEN (1u << 0)
#define TIM16_EGR REGISTER(TIM16_BASE, 0x14u)
#define TIM16_EGR_UG (1u << 0)
#define TIM16_CCMR1_Output REGISTER(TIM16_BASE, 0x18u)
#define TIM16_CCMR1_Output_OC1PE (1u << 3)
#define TIM16_CCMR1_Output_OC1M(value) ((value) << 4)
#define TIM16_CCER REGISTER(TIM16_BASE, 0x20u)
#define TIM16_CCER_CC1E (1u << 0)
#define TIM16_PSC REGISTER(TIM16_BASE, 0x28u)
#define TIM16_ARR REGISTER(TIM16_BASE, 0x2Cu)
#define TIM16_CCR1 REGISTER(TIM16_BASE, 0x34u)
#define TIM16_BDTR REGISTER(TIM16_BASE, 0x44u)
#define TIM16_BDTR_MOE (1u << 15)

#define IWDG_BASE 0x40003000u
#define IWDG_KR REGISTER(IWDG_BASE, 0x00u)
#define IWDG_PR REGISTER(IWDG_BASE, 0x04u)
#define IWDG_RLR REGISTER(IWDG_BASE, 0x08u)

#define NVIC_BASE 0xE000E100u
#define NVIC_ISER0 REGISTER(NVIC_BASE, 0x00u)
#define NVIC_ISER1 REGISTER(NVIC_BASE, 0x04u)

#define NVIC_IPR4 REGISTER(NVIC_BASE, 0x310u)
#define NVIC_IPR4_IPR_N1(value) ((value) << 8)
#define NVIC_IPR9 REGISTER(NVIC_BASE, 0x324u)
#define NVIC_IPR9_IPR_N2(value) ((value) << 16)

#define STK_BASE 0xE000E010u
#define STK_CTRL REGISTER(STK_BASE, 0x00u)
#define STK_CTRL_ENABLE (1u << 0)
#define STK_CTRL_TICKINT (1u << 1)
#define STK_CTRL_CLKSOURCE (1u << 2)
#define STK_LOAD REGISTER(STK_BASE, 0x04u)
#define STK_VAL REGISTER(STK_BASE, 0x08u)

#define SCB_BASE 0xE000ED00u
#define SCB_VTOR REGISTER(SCB_BASE, 0x08u)
#define SCB_AIRCR REGISTER(SCB_BASE, 0x0Cu)
#define SCB_AIRCR_SYSRESETREQ (1u << 2)
#define SCB_AIRCR_VECTKEYSTAT(value) ((value) << 16)

#define FPU_CPACR_BASE 0xE000ED88u
#define FPU_CPACR_CPACR REGISTER(FPU_CPACR_BASE, 0x00u)
#define FPU_CPACR_CPACR_CP(value) ((value) << 20)

#define EXTI0_IRQ 6u
#define EXTI1_IRQ 7u
#define EXTI2_IRQ 8u
#define EXTI3_IRQ 9u
#define EXTI4_IRQ 10u
#define DMA1_CH7_IRQ 17u
#define EXTI9_5_IRQ 23u
#define USART2_IRQ 38u
#define EXTI15_10_IRQ 40u

/* Not in the SVD: 96 bits that are different in every chip (RM0394, section 47.1). */
#define UNIQUE_ID ((const uint8_t *)0x1FFF7590u)

#endif
