// Rangefinders above height fields. MuJoCo tests all triangles of the rectangle that the ray crosses, and projects each
// vertex six times. This returns the same distance, but leaves out triangles that MuJoCo's first test certainly rejects,
// and projects a vertex about twice.
#include <math.h>
#include <mujoco/mujoco.h>

// A ray in the frame of a height field.
struct ray {
  mjtNum point[3], direction[3];
  mjtNum normals[2][3];  // orthogonal to the direction and to each other
};

struct field {
  const mjtNum* size;
  const float* heights;
  int rows, columns;
  mjtNum dx, dy;  // between vertices
};

static mjtNum dot(const mjtNum a[3], const mjtNum b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void to_frame(const mjtNum* mat, const mjtNum* from, mjtNum* to) {
  for (int i = 0; i < 3; ++i) to[i] = mat[i] * from[0] + mat[3 + i] * from[1] + mat[6 + i] * from[2];
}

static void move_to_frame(const mjtNum* pos, const mjtNum* mat, const mjtNum* from, mjtNum* to) {
  const mjtNum difference[3] = {from[0] - pos[0], from[1] - pos[1], from[2] - pos[2]};
  to_frame(mat, difference, to);
}

static void make_normals(struct ray* ray) {
  const mjtNum* v = ray->direction;
  int longest = 2;
  if (fabs(v[0]) >= fabs(v[1]) && fabs(v[0]) >= fabs(v[2]))
    longest = 0;
  else if (fabs(v[1]) >= fabs(v[2]))
    longest = 1;
  mjtNum other[3] = {1, 1, 1};
  other[longest] = 0;
  mju_addScl3(ray->normals[1], other, v, -dot(v, other) / dot(v, v));
  mju_normalize3(ray->normals[1]);
  mju_cross(ray->normals[0], ray->normals[1], v);
  mju_normalize3(ray->normals[0]);
}

// At what distance a ray crosses each face of a box (-x, x, -y, y, -z, z); -1: it does not.
static void cross_faces(const mjtNum* pos, const mjtNum* mat, const mjtNum* size, const mjtNum* point,
                        const mjtNum* direction, mjtNum distances[6]) {
  mjtNum p[3], v[3];
  move_to_frame(pos, mat, point, p);
  to_frame(mat, direction, v);
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    distances[face] = -1;
    if (!(fabs(v[axis]) > mjMINVAL)) continue;
    const mjtNum distance = ((face % 2 ? 1 : -1) * size[axis] - p[axis]) / v[axis];
    if (distance >= 0 && fabs(p[a] + distance * v[a]) <= size[a] && fabs(p[b] + distance * v[b]) <= size[b])
      distances[face] = distance;
  }
}

static void vertex_at(const struct field* field, int row, int column, mjtNum vertex[3]) {
  vertex[0] = field->dx * column - field->size[0];
  vertex[1] = field->dy * row - field->size[1];
  vertex[2] = field->heights[row * field->columns + column] * field->size[2];
}

// The coordinates of a vertex along the ray's two normals, seen from the ray's point.
static void project(const struct ray* ray, const mjtNum vertex[3], mjtNum planar[2]) {
  const mjtNum difference[3] = {vertex[0] - ray->point[0], vertex[1] - ray->point[1], vertex[2] - ray->point[2]};
  for (int k = 0; k < 2; ++k) planar[k] = dot(ray->normals[k], difference);
}

// The distance to a triangle; less than 0 if the ray misses it.
static mjtNum cross_triangle(const struct ray* ray, const mjtNum v[3][3]) {
  mjtNum planar[3][2];
  for (int i = 0; i < 3; ++i) project(ray, v[i], planar[i]);
  for (int k = 0; k < 2; ++k) {
    const mjtNum a = planar[0][k], b = planar[1][k], c = planar[2][k];
    if ((a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0)) return -1;
  }
  // The ray's place in the triangle, as coordinates from vertex 2 to the others.
  const mjtNum a0 = planar[0][0] - planar[2][0], a1 = planar[1][0] - planar[2][0];
  const mjtNum a2 = planar[0][1] - planar[2][1], a3 = planar[1][1] - planar[2][1];
  const mjtNum b0 = -planar[2][0], b1 = -planar[2][1];
  const mjtNum determinant = a0 * a3 - a1 * a2;
  if (fabs(determinant) < mjMINVAL) return -1;
  const mjtNum t0 = (a3 * b0 - a1 * b1) / determinant;
  const mjtNum t1 = (-a2 * b0 + a0 * b1) / determinant;
  if (t0 < 0 || t1 < 0 || t0 + t1 > 1) return -1;
  mjtNum edges[2][3], from[3], normal[3];
  for (int i = 0; i < 2; ++i) mju_sub3(edges[i], v[i], v[2]);
  mju_sub3(from, ray->point, v[2]);
  mju_cross(normal, edges[0], edges[1]);
  const mjtNum speed = dot(ray->direction, normal);
  return fabs(speed) < mjMINVAL ? -1 : -dot(from, normal) / speed;
}

static void keep_nearest(mjtNum* nearest, mjtNum distance) {
  if (distance >= 0 && (*nearest < 0 || distance < *nearest)) *nearest = distance;
}

// Tests both triangles of a cell.
static void cross_cell(const struct ray* ray, const struct field* field, int row, int column, mjtNum* nearest) {
  mjtNum v[3][3];
  vertex_at(field, row, column, v[0]);
  vertex_at(field, row + 1, column + 1, v[1]);
  vertex_at(field, row, column + 1, v[2]);
  keep_nearest(nearest, cross_triangle(ray, v));
  vertex_at(field, row + 1, column, v[2]);
  keep_nearest(nearest, cross_triangle(ray, v));
}

// Columns of a strip between two rows.
struct columns {
  int first, last;
};

// The columns between which the ray can meet the strip, which consists of the cells between two rows with heights from
// low to high. In all other cells, all vertices are on the same side of the ray along one of the normals, by more than
// rounding errors can change.
static struct columns columns_of(const struct ray* ray, const struct field* field, int row, mjtNum low, mjtNum high,
                                 struct columns all) {
  const mjtNum *p = ray->point, *size = field->size;
  const mjtNum y0 = field->dy * row - size[1], y1 = y0 + field->dy, z0 = low * size[2], z1 = high * size[2];
  for (int k = 0; k < 2; ++k) {
    const mjtNum* n = ray->normals[k];
    const mjtNum ny0 = n[1] * y0, ny1 = n[1] * y1, nz0 = n[2] * z0, nz1 = n[2] * z1, np = dot(n, p);
    // n * (vertex - p) without the part of x, for the vertices of the strip.
    const mjtNum least = mjMIN(ny0, ny1) + mjMIN(nz0, nz1) - np, most = mjMAX(ny0, ny1) + mjMAX(nz0, nz1) - np;
    const mjtNum scale = fabs(n[0]) * size[0] + fabs(n[1]) * (size[1] + field->dy) + fabs(nz0) + fabs(nz1) +
                         fabs(n[0] * p[0]) + fabs(n[1] * p[1]) + fabs(n[2] * p[2]);
    const mjtNum margin = 1e-9 * scale;
    const mjtNum a = -(most + margin) / n[0], b = -(least - margin) / n[0];  // x lies between them
    const mjtNum first = (mjMIN(a, b) + size[0]) / field->dx - 2, last = (mjMAX(a, b) + size[0]) / field->dx + 3;
    // These comparisons are false for NaN, and where n[0] is 0 and the ray can meet the strip.
    if (first > all.first) all.first = first < all.last ? (int)first : all.last;
    if (last < all.last) all.last = last > all.first ? (int)last : all.first;
  }
  return all;
}

// The signs of a vertex's coordinates along the normals, as bits. If three vertices have one of them in common, the ray
// misses their triangle. x, y: the terms of the coordinates that project adds first. z: the height above ray->point.
static int signs_of(const struct ray* ray, const mjtNum x[2], const mjtNum y[2], mjtNum z) {
  int signs = 0;
  for (int k = 0; k < 2; ++k) {
    const mjtNum coordinate = x[k] + y[k] + ray->normals[k][2] * z;
    signs |= ((coordinate > 0) | (coordinate < 0) << 1) << 2 * k;
  }
  return signs;
}

static void cross_strip(const struct ray* ray, const struct field* field, int row, struct columns columns,
                        mjtNum* nearest) {
  const float* heights[2];
  mjtNum y[2][2];
  for (int i = 0; i < 2; ++i) {
    heights[i] = field->heights + (row + i) * field->columns;
    const mjtNum from_ray = field->dy * (row + i) - field->size[1] - ray->point[1];
    for (int k = 0; k < 2; ++k) y[i][k] = ray->normals[k][1] * from_ray;
  }
  int before[2] = {0, 0};  // the signs of the vertices of the column before
  for (int column = columns.first; column <= columns.last; ++column) {
    const mjtNum from_ray = field->dx * column - field->size[0] - ray->point[0];
    const mjtNum x[2] = {ray->normals[0][0] * from_ray, ray->normals[1][0] * from_ray};
    int signs[2];
    for (int i = 0; i < 2; ++i) signs[i] = signs_of(ray, x, y[i], heights[i][column] * field->size[2] - ray->point[2]);
    const int diagonal = before[0] & signs[1];
    if (column > columns.first && !(diagonal & signs[0] && diagonal & before[1]))
      cross_cell(ray, field, row, column - 1, nearest);
    before[0] = signs[0];
    before[1] = signs[1];
  }
}

struct range {
  float low, high;
};

static void extend(struct range* range, float height) {
  range->low = height < range->low ? height : range->low;
  range->high = height > range->high ? height : range->high;
}

// The range of a row's heights. Four ranges at once, because each comparison waits for the last one of its range.
static struct range heights_of(const struct field* field, int row, struct columns columns) {
  const float* heights = field->heights + row * field->columns;
  struct range ranges[4];
  for (int i = 0; i < 4; ++i) ranges[i] = (struct range){INFINITY, -INFINITY};
  int column = columns.first;
  for (; column + 3 <= columns.last; column += 4)
    for (int i = 0; i < 4; ++i) extend(&ranges[i], heights[column + i]);
  for (; column <= columns.last; ++column) extend(&ranges[0], heights[column]);
  for (int i = 1; i < 4; ++i) {
    extend(&ranges[0], ranges[i].low);
    extend(&ranges[0], ranges[i].high);
  }
  return ranges[0];
}

static void cross_surface(const struct ray* ray, const struct field* field, const mjtNum segment[2], mjtNum* nearest) {
  mjtNum x[2], y[2];
  for (int i = 0; i < 2; ++i) {
    x[i] = (ray->point[0] + segment[i] * ray->direction[0] + field->size[0]) / field->dx;
    y[i] = (ray->point[1] + segment[i] * ray->direction[1] + field->size[1]) / field->dy;
  }
  const int first_column = (int)floor(mju_min(x[0], x[1])) - 1, last_column = (int)ceil(mju_max(x[0], x[1])) + 1;
  const int first_row = (int)floor(mju_min(y[0], y[1])) - 1, last_row = (int)ceil(mju_max(y[0], y[1])) + 1;
  const struct columns all = {mjMAX(0, first_column), mjMIN(field->columns - 1, last_column)};
  if (all.first >= all.last) return;
  const int row_end = mjMIN(field->rows - 1, last_row);
  int row = mjMAX(0, first_row);
  if (row >= row_end) return;
  struct range below = heights_of(field, row, all);
  for (; row < row_end; ++row) {
    const struct range above = heights_of(field, row + 1, all);
    const float low = below.low < above.low ? below.low : above.low,
                high = below.high > above.high ? below.high : above.high;
    cross_strip(ray, field, row, columns_of(ray, field, row, low, high, all), nearest);
    below = above;
  }
}

// Whether a point of a side is below the edge of the surface. place: how many vertices it is from the beginning of the
// side. Like MuJoCo, takes the sides normal to x from the wrong places if there are not as many rows as columns.
static int is_below_edge(const mjModel* m, const struct field* field, int face, mjtNum place, mjtNum height) {
  const int is_x = face < 2, count = is_x ? field->rows : field->columns;
  const mjtNum first = mju_max(0, mju_min(count - 2, floor(place)));
  mjtNum ends[2];
  for (int i = 0; i < 2; ++i) {
    const int vertex = mju_round(first + i);
    const int start =
        is_x ? (face == 1 ? field->columns - 1 : 0) : (face == 3 ? (field->rows - 1) * field->columns : 0);
    const int index = start + (is_x ? vertex * field->rows : vertex);
    const int beyond = m->nhfielddata - (int)(field->heights - m->hfield_data);
    ends[i] = index >= 0 && index < beyond ? field->heights[index] : 0;  // MuJoCo reads behind the array
  }
  return height < ends[0] * (first + 1 - place) + ends[1] * (place - first);
}

static mjtNum cross_field(const mjModel* m, const mjData* d, int geom, const mjtNum* point, const mjtNum* direction) {
  const int id = m->geom_dataid[geom];
  const mjtNum *pos = d->geom_xpos + 3 * geom, *mat = d->geom_xmat + 9 * geom, *size = m->hfield_size + 4 * id;
  const mjtNum base_size[3] = {size[0], size[1], size[3] * 0.5}, top_size[3] = {size[0], size[1], size[2] * 0.5};
  mjtNum base[3], top[3];
  for (int i = 0; i < 3; ++i) {
    base[i] = pos[i] - mat[3 * i + 2] * size[3] * 0.5;
    top[i] = pos[i] + mat[3 * i + 2] * size[2] * 0.5;
  }
  mjtNum nearest = mju_rayGeom(base, mat, base_size, point, direction, mjGEOM_BOX);
  const mjtNum entry = mju_rayGeom(top, mat, top_size, point, direction, mjGEOM_BOX);
  if (entry < 0) return nearest;

  mjtNum faces[6], segment[2] = {0, entry};
  cross_faces(top, mat, top_size, point, direction, faces);
  for (int i = 0; i < 6; ++i)
    if (faces[i] > segment[1]) {
      segment[0] = entry;
      segment[1] = faces[i];
    }
  struct ray ray;
  move_to_frame(pos, mat, point, ray.point);
  to_frame(mat, direction, ray.direction);
  make_normals(&ray);
  const int rows = m->hfield_nrow[id], columns = m->hfield_ncol[id];
  const struct field field = {size,    m->hfield_data + m->hfield_adr[id], rows,
                              columns, 2.0 * size[0] / (columns - 1),      2.0 * size[1] / (rows - 1)};
  cross_surface(&ray, &field, segment, &nearest);

  for (int face = 0; face < 4; ++face) {
    if (!(faces[face] >= 0 && (faces[face] < nearest || nearest < 0))) continue;
    const int along = face < 2;  // the axis along the side
    const mjtNum place =
        (ray.point[along] + faces[face] * ray.direction[along] + size[along]) / (along ? field.dy : field.dx);
    const mjtNum height = (ray.point[2] + faces[face] * ray.direction[2]) / size[2];
    if (is_below_edge(m, &field, face, place, height)) nearest = faces[face];
  }
  return nearest;
}

static int is_invisible(const mjModel* m, int geom) {
  const int material = m->geom_matid[geom];
  return (material < 0 ? m->geom_rgba[4 * geom + 3] : m->mat_rgba[4 * material + 3]) == 0;
}

// mj_ray for a rangefinder: all groups and static geoms count. Its caller in MuJoCo is engine_sensor.c.
mjtNum mjenv_ray(const mjModel* m, const mjData* d, const mjtNum* point, const mjtNum* direction, const mjtByte* groups,
                 mjtByte counts_static, int excluded_body, int* found) {
  if (m->nhfield == 0 || mju_norm3(direction) < mjMINVAL)
    return mj_ray(m, d, point, direction, groups, counts_static, excluded_body, found);
  mjtNum nearest = -1;
  *found = -1;
  for (int geom = 0; geom < m->ngeom; ++geom) {
    if (m->geom_bodyid[geom] == excluded_body || is_invisible(m, geom)) continue;
    const int type = m->geom_type[geom];
    mjtNum distance;
    if (type == mjGEOM_HFIELD)
      distance = cross_field(m, d, geom, point, direction);
    else if (type == mjGEOM_MESH)
      distance = mj_rayMesh(m, d, geom, point, direction);
    else
      distance = mju_rayGeom(d->geom_xpos + 3 * geom, d->geom_xmat + 9 * geom, m->geom_size + 3 * geom, point,
                             direction, type);
    if (distance >= 0 && (distance < nearest || nearest < 0)) {
      nearest = distance;
      *found = geom;
    }
  }
  return nearest;
}
