"""Compiled loops over the contacts of a network frame.

They hold what has no form in arrays: forests of particles (Tarjan 1975, J. ACM 22, 215-225) and
searches. All take steps that are linear in particles and contacts, but `shortest_path`, whose
steps are linear in the contacts that it meets. What is noted of a particle takes as few bytes as
it can: in a large network the time goes into memory that is not near.

`leader` is a forest: of a particle the one above it, of a root minus the number of particles of
its tree.
"""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def _root(leader, particle):
    """Find the root of a particle's tree, and shorten the way there."""
    above = leader[particle]
    while above >= 0:
        higher = leader[above]
        if higher >= 0:
            leader[particle] = higher
        particle, above = above, higher
    return particle


@njit(nogil=True, cache=True)
def _join(leader, root, below):
    """Hang the smaller of two trees below the root of the larger: the root, and the one below."""
    if leader[root] > leader[below]:
        root, below = below, root
    leader[root] += leader[below]
    leader[below] = root
    return root, below


@njit(nogil=True, cache=True)
def link_particles(particles, first, second, end_first, end_second):
    """Link pairs of particles in their order, if both ends are free and no ring is closed.

    Parameters
    ----------
    particles : int
        Number of particles, N.
    first, second : (P,) ndarray of int64
        The pairs.
    end_first, end_second : (P,) ndarray of bool
        At which end of either particle the pair would be linked.

    Returns
    -------
    near, by : (N, 2) ndarray of int64
        The particle that is linked to each end of a particle, and the pair that links them; or -1.
    """
    near = np.full((particles, 2), -1)
    by = np.full((particles, 2), -1)
    leader = np.full(particles, -1, dtype=np.int32)
    for pair in range(len(first)):
        i, j = first[pair], second[pair]
        end_i, end_j = int(end_first[pair]), int(end_second[pair])
        if near[i, end_i] >= 0 or near[j, end_j] >= 0:
            continue
        root_i, root_j = _root(leader, i), _root(leader, j)
        if root_i != root_j:
            _join(leader, root_i, root_j)
            near[i, end_i], near[j, end_j] = j, i
            by[i, end_i] = by[j, end_j] = pair
    return near, by


@njit(nogil=True, cache=True)
def walk_links(near, by, ends, least):
    """List the paths that links make, each from that of its two end particles which comes first.

    Parameters
    ----------
    near, by : (N, 2) ndarray of int64
        As `link_particles` returns them.
    ends : (E,) ndarray of int64
        The particles with one link.
    least : int
        Fewest particles of a path that is listed.

    Returns
    -------
    particles : (K,) ndarray of int64
        The particles of all paths, one path after another.
    pairs : (K - C,) ndarray of int64
        The pairs that link them.
    starts : (C + 1,) ndarray of int64
        Where each path begins in `particles`, and where the last one ends.
    """
    linked = (near[:, 0] >= 0) | (near[:, 1] >= 0)
    particles = np.empty(linked.sum(), dtype=np.int64)
    pairs = np.empty(linked.sum(), dtype=np.int64)
    starts = np.zeros(len(ends) // 2 + 1, dtype=np.int64)
    seen = np.zeros(len(near), dtype=np.bool_)
    paths = 0
    for start in ends:
        if seen[start]:
            continue
        size, before, particle = starts[paths], -1, start
        while True:
            particles[size] = particle
            size += 1
            end = 0 if near[particle, 0] >= 0 and near[particle, 0] != before else 1
            after = near[particle, end]
            if after < 0 or after == before:
                break
            pairs[size - 1 - paths] = by[particle, end]
            before, particle = particle, after
        seen[particle] = True
        if size - starts[paths] >= least:
            paths += 1
            starts[paths] = size
    return particles[: starts[paths]], pairs[: starts[paths] - paths], starts[: paths + 1]


@njit(nogil=True, cache=True)
def widths(a, b, force, order, nodes, target):
    """The bottleneck of the widest path from every node to one of them.

    The forest grows by falling force (Kruskal 1956, Proc. Am. Math. Soc. 7, 48-50): the force that
    joins a node to the target is the bottleneck (Hu 1961, Oper. Res. 9, 898-900).

    Parameters
    ----------
    a, b : (M,) ndarray of int64
        The nodes that each edge joins.
    force : (M,) ndarray
    order : (M,) ndarray of int64
        The edges by falling force.
    nodes : int
        Number of nodes.
    target : int
        Where the paths lead.

    Returns
    -------
    (nodes,) ndarray
        Infinite for the target, minus infinite where no path leads there.
    """
    width = np.full(nodes, -np.inf)
    width[target] = np.inf
    leader = np.full(nodes, -1, dtype=np.int32)
    following = np.arange(nodes).astype(np.int32)  # the nodes of a tree as a ring
    for edge in order:
        root_a, root_b = _root(leader, a[edge]), _root(leader, b[edge])
        if root_a == root_b:
            continue
        if (width[root_a] == -np.inf) != (width[root_b] == -np.inf):
            lost = root_a if width[root_a] == -np.inf else root_b
            node = lost
            while True:
                width[node] = force[edge]
                node = following[node]
                if node == lost:
                    break
        _join(leader, root_a, root_b)
        following[root_a], following[root_b] = following[root_b], following[root_a]
    return width


@njit(nogil=True, cache=True)
def search_space(nodes):
    """What `shortest_path` notes of every node, to be used for many searches."""
    mark = np.full(nodes, -1, dtype=np.int32)
    depth, queue = np.empty(nodes, dtype=np.int32), np.empty(nodes, dtype=np.int32)
    come, by = np.empty(nodes, dtype=np.int32), np.empty(nodes, dtype=np.int32)
    return mark, depth, queue, come, by, np.empty(nodes)


@njit(nogil=True, cache=True)
def shortest_path(net, force, start, target, least, search, space):
    """Find the path with the fewest edges among those of `least` force at least.

    Level by level from the start; among the edges that lead to a node from the level before, the
    one counts that gives the largest sum of forces from the start on, among equal ones the first:
    nodes are met in the order of their level, their edges in the order of `net`.

    Parameters
    ----------
    net : tuple
        As `dragchain.network.chains.adjacency` returns it.
    force : (M,) ndarray
        Of the edges.
    start, target : int
        Two nodes.
    least : float
    search : int
        A number from 0 on that is another one for every search.
    space : tuple
        As `search_space` returns it.

    Returns
    -------
    particles, edges : (L,) ndarray of int64
        The nodes from the start on, without the target, and the edge behind each; empty if
        there is no path.
    """
    starts, near, edge = net
    mark, depth, queue, come, by, total = space
    mark[start], depth[start], queue[0], total[start] = search, 0, start, 0.0
    low, high, level = 0, 1, 0
    while mark[target] != search and low < high:
        end = high
        for place in range(low, high):
            node = queue[place]
            for k in range(starts[node], starts[node + 1]):
                other, strength = near[k], force[edge[k]]
                new = mark[other] != search
                if strength < least or not (new or depth[other] > level):
                    continue
                if new:
                    mark[other], depth[other], queue[end] = search, level + 1, other
                    end += 1
                if new or total[node] + strength > total[other]:
                    total[other], come[other], by[other] = total[node] + strength, node, edge[k]
        low, high, level = high, end, level + 1
    size = depth[target] if mark[target] == search else 0
    particles, edges = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    node = target
    for place in range(size - 1, -1, -1):
        edges[place] = by[node]
        node = come[node]
        particles[place] = node
    return particles, edges


@njit(nogil=True, cache=True)
def grow_clusters(a, b, touch, spans, stops, particles):
    """Join particles contact by contact, and keep count of the clusters (Newman and Ziff 2001).

    Parameters
    ----------
    a, b : (M,) ndarray of int64
        The particles of each contact, in the order in which contacts join; ``b`` is negative where
        the other body is no particle.
    touch : (M,) ndarray of uint8
        Bits of the places that particle ``a`` touches with the contact.
    spans : (S, 2) ndarray of uint8
        A cluster spans if it touches one of the places of either column.
    stops : (K,) ndarray of int64
        Rising numbers of contacts after which the clusters are counted.
    particles : int
        Number of particles.

    Returns
    -------
    counts : (K, 4) ndarray of int64
        Clusters of two particles or more, the particles in them, the particles of the largest, and
        the sum of the squares of all their sizes.
    joined : (S,) ndarray of int64
        The contact with which a cluster spans for the first time, or -1.
    """
    leader = np.full(particles, -1, dtype=np.int32)
    places = np.zeros(particles, dtype=np.uint8)
    counts = np.zeros((len(stops), 4), dtype=np.int64)
    joined = np.full(len(spans), -1)
    clusters = members = largest = squares = np.int64(0)
    stop = 0
    for contact in range(len(a) + 1):
        while stop < len(stops) and stops[stop] == contact:
            counts[stop] = clusters, members, largest, squares
            stop += 1
        if contact == len(a):
            break
        root = _root(leader, a[contact])
        if b[contact] >= 0:
            other = _root(leader, b[contact])
            if other == root:
                continue
            for tree in (root, other):
                size = -np.int64(leader[tree])
                members += size == 1
                clusters -= size > 1
                squares -= size**2 * (size > 1)
            root, below = _join(leader, root, other)
            places[root] |= places[below]
            size = -np.int64(leader[root])
            clusters += 1
            squares += size**2
            largest = max(largest, size)
        else:
            places[root] |= touch[contact]
        if places[root]:
            for span in range(len(spans)):
                spanned = places[root] & spans[span, 0] and places[root] & spans[span, 1]
                if spanned and joined[span] < 0:
                    joined[span] = contact
    return counts, joined
