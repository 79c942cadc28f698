/* The receiver's two ends in one call, for tests of many frames. */
#include "link.h"

typedef void (*frame_function)(uint8_t type, uint8_t sequence, const uint8_t *payload, size_t size);

void host_receive(const uint8_t *bytes, size_t size, frame_function on_frame);

void host_receive(const uint8_t *bytes, size_t size, frame_function on_frame)
{
    struct frame frame;
    for (size_t i = 0; i < size; i++) {
        link_byte_received(bytes[i]);
        while (link_receive(&frame))
            on_frame(frame.type, frame.sequence, frame.payload, frame.size);
    }
}
