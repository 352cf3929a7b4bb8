// Any answers, strays and silences.
#include "drivers/saa_can/family.h"

#include "tests/fuzz/probe_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::ProbeFuzz fuzz(axlecast::saa_can_probe({}), input);
  fuzz.Run([](axlecast::Bytes request) { return request.empty(); });
  return 0;
}
