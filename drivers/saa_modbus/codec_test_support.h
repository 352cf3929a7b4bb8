#pragma once

#include "drivers/saa_modbus/codec.h"

namespace axlecast::saa_modbus {

// Returns the frame with this content.
inline Frame Encoded(const Request& request) {
  switch (request.function) {
    case kReadPosition:
      return ReadRequest(request.address, request.registers);
    case kQueryAddress:
      return QueryRequest();
    case kSetAddress:
      return SetAddressRequest(request.address, request.new_address);
    default:
      return SetParameterRequest(request.address, request.parameter);
  }
}

}  // namespace axlecast::saa_modbus
