#include "client/command/permit_message.h"

#include <algorithm>

#include "client/axlecast/permit_issuer.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr std::size_t kMaxPermit = 1'200;  // permit_t.permit_size

bool IsPermitName(const std::string& text) {
  return !text.empty() && text.size() <= kLongestName && text.find('\0') == std::string::npos;
}

}  // namespace

permit_t MakePermit(permit_body_t body, const SigningKey* key) {
  body.n_operations = static_cast<std::int8_t>(body.operations.size());
  body.key_id = key != nullptr ? KeyId(key->public_key()) : 0;
  permit_t permit{};
  permit.permit.resize(static_cast<std::size_t>(body.getEncodedSize()));
  body.encode(permit.permit.data(), 0, static_cast<int>(permit.permit.size()));
  permit.permit_size = static_cast<std::int16_t>(permit.permit.size());
  if (key == nullptr) return permit;
  const Signature signature = key->Sign(Domain::kPermit, permit.permit);
  std::copy(signature.begin(), signature.end(), std::begin(permit.sig));
  return permit;
}

bool FitsPermit(const std::string& device, const std::vector<std::string>& operations) {
  if (!IsPermitName(device) || operations.size() > PermitIssuer::kMaxOperations) return false;
  if (!std::all_of(operations.begin(), operations.end(), IsPermitName)) return false;
  permit_body_t body{};
  body.device = device;
  body.operations = operations;
  body.n_operations = static_cast<std::int8_t>(operations.size());
  return static_cast<std::size_t>(body.getEncodedSize()) <= kMaxPermit;
}

}  // namespace axlecast
