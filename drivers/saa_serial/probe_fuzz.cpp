// Any answers, strays and silences.
#include "drivers/saa_serial/family.h"

#include "tests/fuzz/probe_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::ProbeFuzz fuzz(axlecast::saa_serial_probe({.rates = {115'200}}), input);
  fuzz.Run([](axlecast::Bytes request) { return request.size() == 3 && (request[2] & 0xF0) == 0xB0; });
  return 0;
}
