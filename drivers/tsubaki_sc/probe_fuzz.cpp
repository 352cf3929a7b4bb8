// Any answers, strays and silences.
#include "drivers/tsubaki_sc/family.h"

#include "tests/fuzz/probe_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::ProbeFuzz fuzz(axlecast::tsubaki_sc_probe({}), input);
  fuzz.Run([](axlecast::Bytes request) { return request[1] == 0x03 || request[1] == 0x04 || request[1] == 0x11; });
  return 0;
}
