#pragma once

#include "drivers/saa_modbus/codec.h"

namespace axlecast::saa_modbus {

// The frame that says this.
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
