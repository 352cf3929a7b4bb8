#pragma once

namespace axlecast {

// Tests of very many values take all of them in an optimised build (tools/campaign unit_tests). Under sanitizers, where each value takes
// ten times as long, they take a share of them (tools/test).
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kAllValues = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kAllValues = false;
#else
inline constexpr bool kAllValues = true;
#endif
#else
inline constexpr bool kAllValues = true;
#endif

// Returns the step of a loop over values: 1, or `step` under sanitizers.
template <typename Number>
[[nodiscard]] constexpr Number StepOfValues(Number step) {
  return kAllValues ? Number{1} : step;
}

// Returns how many times something random is tried: `times`, or the `share`-th part of it under sanitizers.
template <typename Number>
[[nodiscard]] constexpr Number Times(Number times, Number share) {
  return kAllValues ? times : times / share;
}

}  // namespace axlecast
