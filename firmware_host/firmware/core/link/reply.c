#include "reply.h"

#include "link.h"

void reply_done(uint8_t sequence)
{
    struct ack_payload ack = {.reply_to = sequence};
    link_send(MESSAGE_ACK, &ack, sizeof ack);
}

void reply_refused(const struct frame *request, enum error_code code, uint8_t sensor)
{
    struct error_payload error = {.reply_to = request->sequence, .code = (uint8_t)code, .sensor = sensor};
    link_send(MESSAGE_ERROR, &error, sizeof error);
}
