#include "core/command/device_summary.h"

#include "core/base/text.h"

namespace axlecast {

driver_device_t MessageOf(const DeviceSummary& device) {
  driver_device_t message{};
  message.device = CappedText(device.device, kNameBytes);
  message.state = device.state;
  message.datum_epoch = device.datum_epoch;
  message.reference_lost = device.reference_lost ? 1 : 0;
  message.identity = CappedText(device.identity, kIdentityBytes);
  if (device.datum) {
    message.has_datum = 1;
    message.datum_counts = device.datum->counts;
    message.datum_utime = device.datum->utime;
  }
  if (device.position) {
    message.has_position = 1;
    message.position = device.position->counts;
    message.position_utime = device.position->utime;
  }
  return message;
}

}  // namespace axlecast
