// The peer of `cargo xtask rays`: the same rays through Embree, on one thread.
//
// usage: embree FOLDER, then on standard input lines "MODE FLAGS WIDTH": MODE camera, shadow or soft, FLAGS robust or fast, WIDTH 1, 4, 8
// or 16. Each is answered by the seconds of processor time it took, and leaves its hits in FOLDER/embree.hits.
// FOLDER holds, in this machine's byte order: mesh (u64 vertices, u64 triangles, u64 copies, then f32 x 3, u32 x 3, f32 x 3 each),
// camera and shadow (u64 rays, f32 x 6 each: origin, direction; shadow rays end at t = 0.999), and for soft (u64 points, u64 samples,
// f32 x 9 each: start, point, normal; f32 x 3 each): rays from each start by the way from point to sample, where that is above
// the surface; embree.hits then has a bit for each.
#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>
#include <time.h>

static double now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + t.tv_nsec * 1e-9;
}

template <class T> static std::vector<T> take(FILE *file, size_t count) {
  std::vector<T> values(count + 4);  // Embree reads 16 bytes where a vertex has 12
  if (fread(values.data(), sizeof(T), count, file) != count) { fprintf(stderr, "embree: short file\n"); exit(1); }
  values.resize(count);
  return values;
}

static FILE *file(const std::string &path, const char *how) {
  FILE *f = fopen(path.c_str(), how);
  if (!f) { perror(path.c_str()); exit(1); }
  return f;
}

static std::vector<float> rays_of(const std::string &path) {
  FILE *f = file(path, "rb");
  uint64_t count = take<uint64_t>(f, 1)[0];
  auto rays = take<float>(f, count * 6);
  fclose(f);
  return rays;
}

static size_t bytes;
static bool monitor(void *, ssize_t more, bool) { bytes += more; return true; }

struct Hit { float t; uint32_t triangle; };

template <int N> struct Wide;
#define WIDE(N)                                                                                     \
  template <> struct Wide<N> {                                                                      \
    using Ray = RTCRay##N;                                                                          \
    using RayHit = RTCRayHit##N;                                                                    \
    static void intersect(const int *valid, RTCScene s, RTCIntersectContext *c, RayHit *r) {        \
      rtcIntersect##N(valid, s, c, r);                                                              \
    }                                                                                               \
    static void occluded(const int *valid, RTCScene s, RTCIntersectContext *c, Ray *r) {            \
      rtcOccluded##N(valid, s, c, r);                                                               \
    }                                                                                               \
  };
WIDE(4) WIDE(8) WIDE(16)

template <int N, class R> static void load(R &ray, const float *from, float t_max) {
  for (int k = 0; k < N; k++, from += 6) {
    ray.org_x[k] = from[0]; ray.org_y[k] = from[1]; ray.org_z[k] = from[2];
    ray.dir_x[k] = from[3]; ray.dir_y[k] = from[4]; ray.dir_z[k] = from[5];
    ray.tnear[k] = 0; ray.tfar[k] = t_max; ray.time[k] = 0; ray.mask[k] = -1; ray.id[k] = k; ray.flags[k] = 0;
  }
}

template <int N> static void packets(RTCScene scene, bool camera, const std::vector<float> &rays, std::vector<Hit> &hits) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) int valid[N];
  for (int k = 0; k < N; k++) valid[k] = -1;
  for (size_t i = 0; i + N <= hits.size(); i += N) {
    if (camera) {
      alignas(64) typename Wide<N>::RayHit r;
      load<N>(r.ray, &rays[6 * i], std::numeric_limits<float>::infinity());
      for (int k = 0; k < N; k++) r.hit.geomID[k] = r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      Wide<N>::intersect(valid, scene, &context, &r);
      for (int k = 0; k < N; k++)
        hits[i + k] = {r.ray.tfar[k], r.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? ~0u : r.hit.primID[k]};
    } else {
      alignas(64) typename Wide<N>::Ray r;
      load<N>(r, &rays[6 * i], 0.999f);
      Wide<N>::occluded(valid, scene, &context, &r);
      for (int k = 0; k < N; k++) hits[i + k] = {r.tfar[k], 0};
    }
  }
}

static void single(RTCScene scene, bool camera, const std::vector<float> &rays, std::vector<Hit> &hits) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (size_t i = 0; i < hits.size(); i++) {
    const float *p = &rays[6 * i];
    RTCRayHit r;
    r.ray = {p[0], p[1], p[2], 0, p[3], p[4], p[5], 0, camera ? std::numeric_limits<float>::infinity() : 0.999f, ~0u, 0, 0};
    r.hit.geomID = r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    if (camera) rtcIntersect1(scene, &context, &r); else rtcOccluded1(scene, &context, &r.ray);
    hits[i] = {r.ray.tfar, r.hit.geomID == RTC_INVALID_GEOMETRY_ID ? ~0u : r.hit.primID};
  }
}

// Packets of N samples of one point.
template <int N> static void soft(RTCScene scene, const std::vector<float> &points, const std::vector<float> &samples, std::vector<uint16_t> &hits) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) int valid[N];
  alignas(64) typename Wide<N>::Ray r;
  size_t count = samples.size() / 3;
  // Coordinate by coordinate
  std::vector<float> x(count), y(count), z(count);
  for (size_t k = 0; k < count; k++) { x[k] = samples[3 * k]; y[k] = samples[3 * k + 1]; z[k] = samples[3 * k + 2]; }
  for (size_t i = 0; i < points.size() / 9; i++) {
    const float *p = &points[9 * i];
    for (size_t k = 0; k < count; k += N) {
      int any = 0;
      for (int j = 0; j < N; j++) {
        float dx = x[k + j] - p[3], dy = y[k + j] - p[4], dz = z[k + j] - p[5];
        r.org_x[j] = p[0]; r.org_y[j] = p[1]; r.org_z[j] = p[2];
        r.dir_x[j] = dx; r.dir_y[j] = dy; r.dir_z[j] = dz;
        r.tnear[j] = 0; r.tfar[j] = 0.9999f; r.time[j] = 0; r.mask[j] = -1; r.id[j] = j; r.flags[j] = 0;
        valid[j] = dx * p[6] + dy * p[7] + dz * p[8] > 0 ? -1 : 0;
        any |= valid[j];
      }
      if (!any) continue;
      Wide<N>::occluded(valid, scene, &context, &r);
      uint16_t bits = 0;
      for (int j = 0; j < N; j++) bits |= (r.tfar[j] < 0 ? 1 : 0) << j;
      hits[(i * count + k) / 16] |= bits << (k % 16);
    }
  }
}

int main(int argc, char **argv) {
  if (argc < 2) return 1;
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  std::string folder = argv[1];
  FILE *f = file(folder + "/mesh", "rb");
  auto counts = take<uint64_t>(f, 3);
  auto positions = take<float>(f, counts[0] * 3);
  auto triangles = take<uint32_t>(f, counts[1] * 3);
  auto offsets = take<float>(f, counts[2] * 3);
  fclose(f);
  RTCDevice device = rtcNewDevice("threads=1");
  rtcSetDeviceMemoryMonitorFunction(device, monitor, nullptr);
  RTCScene scenes[2], inner[2];
  double seconds[2];
  size_t used[2];
  for (int robust = 0; robust < 2; robust++) {
    size_t before = bytes;
    double start = now();
    RTCScene scene = inner[robust] = rtcNewScene(device);
    rtcSetSceneFlags(scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.data(), 0, 12, counts[0]);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles.data(), 0, 12, counts[1]);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcCommitScene(scene);
    if (counts[2] > 0) {
      RTCScene outer = rtcNewScene(device);
      rtcSetSceneFlags(outer, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
      for (size_t i = 0; i < counts[2]; i++) {
        RTCGeometry copy = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(copy, scene);
        float m[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, offsets[3 * i], offsets[3 * i + 1], offsets[3 * i + 2]};
        rtcSetGeometryTransform(copy, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, m);
        rtcCommitGeometry(copy);
        rtcAttachGeometry(outer, copy);
        rtcReleaseGeometry(copy);
      }
      rtcCommitScene(outer);
      scene = outer;
    }
    scenes[robust] = scene;
    seconds[robust] = now() - start;
    used[robust] = bytes - before;
  }
  printf("%zu %zu %g %g\n", used[0], used[1], seconds[0], seconds[1]);
  fflush(stdout);
  auto camera = rays_of(folder + "/camera"), shadow = rays_of(folder + "/shadow");
  std::vector<float> points, samples;
  if (FILE *f = fopen((folder + "/soft").c_str(), "rb")) {
    auto counts = take<uint64_t>(f, 2);
    points = take<float>(f, counts[0] * 9);
    samples = take<float>(f, counts[1] * 3);
    fclose(f);
  }
  char line[256], mode[32], flags[32];
  int width;
  while (fgets(line, sizeof line, stdin) && sscanf(line, "%31s %31s %d", mode, flags, &width) == 3) {
    if (!strcmp(mode, "soft")) {
      RTCScene scene = scenes[!strcmp(flags, "robust")];
      std::vector<uint16_t> hits(points.size() / 9 * (samples.size() / 3) / 16);
      double start = now();
      if (width == 8) soft<8>(scene, points, samples, hits); else soft<16>(scene, points, samples, hits);
      double took = now() - start;
      FILE *out = file(folder + "/embree.hits", "wb");
      fwrite(hits.data(), sizeof(uint16_t), hits.size(), out);
      fclose(out);
      printf("%.9f\n", took);
      fflush(stdout);
      continue;
    }
    bool is_camera = !strcmp(mode, "camera");
    const auto &rays = is_camera ? camera : shadow;
    RTCScene scene = scenes[!strcmp(flags, "robust")];
    std::vector<Hit> hits(rays.size() / 6);
    double start = now();
    switch (width) {
      case 1: single(scene, is_camera, rays, hits); break;
      case 4: packets<4>(scene, is_camera, rays, hits); break;
      case 8: packets<8>(scene, is_camera, rays, hits); break;
      case 16: packets<16>(scene, is_camera, rays, hits); break;
    }
    double took = now() - start;
    FILE *out = file(folder + "/embree.hits", "wb");
    fwrite(hits.data(), sizeof(Hit), hits.size(), out);
    fclose(out);
    printf("%.9f\n", took);
    fflush(stdout);
  }
  return 0;
}
