/* A driver for machines without libFuzzer: `… SECONDS SEED_FILE …` runs the seeds, then random changes of them. The same seeds
   give the same inputs in every run. A failing input is written to the file fuzz-failure. */
#include <sanitizer/common_interface_defs.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define INPUT_MAX 4096u
#define SEEDS_MAX 256u

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static struct input {
    uint8_t bytes[INPUT_MAX];
    size_t size;
} seeds[SEEDS_MAX], input;

static size_t seed_count;

static size_t below(size_t limit)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return limit == 0 ? 0 : (size_t)(state >> 33) % limit;
}

/* Replaces `gone` bytes at a random offset by `size` bytes of another seed, or random ones. */
static void replace(size_t gone, size_t size)
{
    const struct input *other = &seeds[below(seed_count)];
    size_t place = below(input.size + 1), from = below(other->size);
    if (place + gone > input.size || from + size > other->size || input.size - gone + size > INPUT_MAX)
        return;
    memmove(&input.bytes[place + size], &input.bytes[place + gone], input.size - place - gone);
    memcpy(&input.bytes[place], &other->bytes[from], size);
    for (size_t i = 0; i < size && below(2); i++)
        input.bytes[place + i] = (uint8_t)below(256);
    input.size = input.size - gone + size;
}

static void change(void)
{
    input = seeds[below(seed_count)];
    for (size_t changes = 1 + below(8); changes != 0; changes--) {
        size_t size = 1 + below(below(4) ? 4 : 200);
        if (below(3))
            replace(size, size);
        else
            replace(below(2) ? size : 0, below(2) ? size : 0);
    }
}

static void leave_failure(void)
{
    FILE *file = fopen("fuzz-failure", "wb");
    if (file != NULL) {
        fwrite(input.bytes, 1, input.size, file);
        fclose(file);
    }
}

static void aborted(int number)
{
    leave_failure();
    signal(number, SIG_DFL);
}

static void run(void)
{
    LLVMFuzzerTestOneInput(input.bytes, input.size);
}

int main(int count, char **arguments)
{
    __sanitizer_set_death_callback(leave_failure);
    signal(SIGABRT, aborted);
    for (int i = 2; i < count && seed_count < SEEDS_MAX; i++) {
        FILE *file = fopen(arguments[i], "rb");
        if (file == NULL)
            return 2;
        input.size = fread(input.bytes, 1, INPUT_MAX, file);
        fclose(file);
        seeds[seed_count++] = input;
        run();
    }
    if (count < 2 || seed_count == 0)
        return 2;
    unsigned long runs = seed_count;
    for (time_t end = time(NULL) + atoi(arguments[1]); time(NULL) < end; runs++) {
        change();
        run();
    }
    printf("%lu inputs, none failed\n", runs);
    return 0;
}
