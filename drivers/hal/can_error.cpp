#include "drivers/hal/can_error.h"

#include <linux/can/error.h>

namespace axlecast {
namespace {

constexpr std::size_t kControllerStatus = 1;
constexpr std::size_t kProtocolType = 2;
constexpr std::size_t kProtocolLocation = 3;
constexpr std::size_t kTransmitErrors = 6;
constexpr std::size_t kReceiveErrors = 7;

constexpr unsigned kErrorTypes = CAN_ERR_PROT_BIT | CAN_ERR_PROT_FORM | CAN_ERR_PROT_STUFF | CAN_ERR_PROT_BIT0 |
                                 CAN_ERR_PROT_BIT1 | CAN_ERR_PROT_OVERLOAD;

// Many drivers (sja1000, m_can, c_can) tell a missing acknowledge only by where the protocol was violated.
bool Unacknowledged(std::uint32_t classes, unsigned type, unsigned location) {
  if ((classes & CAN_ERR_ACK) != 0) return true;
  return (classes & CAN_ERR_PROT) != 0 && location == CAN_ERR_PROT_LOC_ACK && (type & kErrorTypes) == 0;
}

// A room for frames was full: some drivers (slcan) give such a frame the class of bus errors too, without any.
bool OnlyOverflow(unsigned status, unsigned type, unsigned location) {
  return (status & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0 && type == 0 && location == 0;
}

}  // namespace

void CountCanError(const CanFrame& frame, CanController& controller) {
  if ((frame.id & kCanError) == 0) return;
  const std::uint32_t classes = frame.id & kCanExtendedMask;
  const auto data = [&](std::size_t i) { return i < frame.data.size() ? unsigned{frame.data.data()[i]} : 0U; };

  const unsigned status = (classes & CAN_ERR_CRTL) != 0 ? data(kControllerStatus) : 0;
  if ((classes & CAN_ERR_BUSOFF) != 0) ++controller.bus_offs;
  if ((classes & CAN_ERR_RESTARTED) != 0) ++controller.restarts;
  if (Unacknowledged(classes, data(kProtocolType), data(kProtocolLocation))) {
    ++controller.unacknowledged;
  } else if ((classes & (CAN_ERR_PROT | CAN_ERR_BUSERROR)) != 0 &&
             !OnlyOverflow(status, data(kProtocolType), data(kProtocolLocation))) {
    ++controller.bus_errors;
  }
  if ((status & CAN_ERR_CRTL_RX_OVERFLOW) != 0) ++controller.overruns;
  if ((status & CAN_ERR_CRTL_TX_OVERFLOW) != 0) ++controller.queue_full;
  if ((classes & CAN_ERR_CNT) != 0 && frame.data.size() == CAN_ERR_DLC) {
    controller.tec = static_cast<int>(data(kTransmitErrors));
    controller.rec = static_cast<int>(data(kReceiveErrors));
  }
}

}  // namespace axlecast
