/* Vector table, reset and faults. */
#include "startup.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "registers.h"

#define STACK_PAINT 0x5AFE57ACu

/* The linker script's. Their addresses are what they say. */
extern uint32_t stack_bottom[], stack_top[], data_load[], data_start[], data_end[], bss_start[], bss_end[];

struct fault_record fault_record __attribute__((section(".noinit")));

int main(void);
void reset_handler(void);
void fault_handler(void);
void nmi_handler(void);
void exti0_handler(void);
void exti1_handler(void);
void exti2_handler(void);
void exti3_handler(void);
void exti4_handler(void);
void exti9_5_handler(void);
void dma1_channel7_handler(void);
void usart2_handler(void);
void exti15_10_handler(void);
void systick_handler(void);

static void paint_stack(void)
{
    uint32_t *top;
    __asm volatile("mov %0, sp" : "=r"(top));
    for (volatile uint32_t *word = stack_bottom; word < top; word++)
        *word = STACK_PAINT;
}

uint32_t stack_high_water(void)
{
    const uint32_t *word = stack_bottom;
    while (word < stack_top && *word == STACK_PAINT)
        word++;
    return (uint32_t)((const uint8_t *)stack_top - (const uint8_t *)word);
}

void reset_handler(void)
{
    FPU_CPACR_CPACR |= FPU_CPACR_CPACR_CP(0xFu); /* before anything the compiler may use the FPU for */
    __asm volatile("dsb\n isb");
    SCB_VTOR = 0x08000000u;
    paint_stack();
    memcpy(data_start, data_load, (size_t)((uint8_t *)data_end - (uint8_t *)data_start));
    memset(bss_start, 0, (size_t)((uint8_t *)bss_end - (uint8_t *)bss_start));
    main();
}

/* The barriers: a store still under way would be lost, and the request takes some cycles to act. */
_Noreturn void reset_chip(void)
{
    __asm volatile("dsb" ::: "memory");
    SCB_AIRCR = SCB_AIRCR_VECTKEYSTAT(0x05FAu) | SCB_AIRCR_SYSRESETREQ;
    __asm volatile("dsb");
    for (;;)
        ;
}

#define FRAME_WORDS 8 /* r0 r1 r2 r3 r12 lr pc xpsr */

/* Records the address of the fault and restarts: a board that answers "fault at …" helps more than one that hangs.
   After a stack overflow there is no frame to read, and reading it would fault in here, which stops the core. */
__attribute__((used)) static void record_fault(const uint32_t *frame)
{
    bool on_stack = frame >= stack_bottom && frame + FRAME_WORDS <= stack_top;
    fault_record.magic = FAULT_MAGIC;
    fault_record.pc = on_stack ? frame[6] : 0;
    reset_chip();
}

/* Naked: the stack pointer must still be the exception frame's. The stack restarts at its top, because the pointer may have left
   it. */
__attribute__((naked)) void fault_handler(void)
{
    __asm volatile("mov r0, sp\n ldr r1, =stack_top\n mov sp, r1\n b record_fault");
}

/* A doubleword that a power loss tore does no harm where the store is read; any other NMI is a fault. Naked for the same
   reason; what it changes, the exception's return restores. */
__attribute__((naked)) void nmi_handler(void)
{
    __asm volatile("push {r4, lr}\n bl flash_take_torn_read\n cmp r0, #0\n pop {r4, lr}\n beq fault_handler\n bx lr");
}

typedef void (*vector)(void);

#define INTERRUPT(number) (15u + (number)) /* exceptions 1 … 15 come first */

/* Only what is enabled has an entry; anything else would jump to 0, which faults. */
__attribute__((section(".vectors"), used)) static const struct {
    const void *stack;
    vector entries[INTERRUPT(EXTI15_10_IRQ) + 1u];
} vectors = {
    stack_top,
    {
        [0] = reset_handler,
        [1] = nmi_handler,
        [2] = fault_handler, /* HardFault, to which all other faults lead while they are not enabled */
        [14] = systick_handler,
        [INTERRUPT(EXTI0_IRQ)] = exti0_handler,
        [INTERRUPT(EXTI1_IRQ)] = exti1_handler,
        [INTERRUPT(EXTI2_IRQ)] = exti2_handler,
        [INTERRUPT(EXTI3_IRQ)] = exti3_handler,
        [INTERRUPT(EXTI4_IRQ)] = exti4_handler,
        [INTERRUPT(DMA1_CH7_IRQ)] = dma1_channel7_handler,
        [INTERRUPT(EXTI9_5_IRQ)] = exti9_5_handler,
        [INTERRUPT(USART2_IRQ)] = usart2_handler,
        [INTERRUPT(EXTI15_10_IRQ)] = exti15_10_handler,
    },
};
